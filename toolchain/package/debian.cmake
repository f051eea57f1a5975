# Debian packages (`cpack`): tricoil (programs), libtricoil0.1, libtricoil-dev, and python3-tricoil if the Python package is built.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tricoil)
set(CPACK_PACKAGE_CONTACT "The tricoil project <maintainers@tricoil.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_OUTPUT_FILE_PREFIX ${CMAKE_BINARY_DIR})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
# Copyright, changelog and compressed files; triggers; see there.
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_SOURCE_DIR}/debian_files.cmake)
set(CPACK_POST_BUILD_SCRIPTS ${CMAKE_CURRENT_SOURCE_DIR}/debian_control.cmake)
set(CPACK_TRICOIL_PACKAGE_FOLDER ${CMAKE_CURRENT_SOURCE_DIR})

# tricoil_debian_package(COMPONENT PACKAGE SECTION SYNOPSIS TEXT): TEXT describes the package, in lines.
macro(tricoil_debian_package component package section synopsis text)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_TRICOIL_PACKAGE_OF_${component} ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${synopsis}\n${text}")
endmacro()

set(about "tricoil computes the position and attitude of a sensor from the couplings\nof three source coils and three sensor coils that carry alternating\ncurrents of 7 to 14 kHz.")
tricoil_debian_package(Unspecified tricoil science "AC electromagnetic tracker: programs"
  "${about}\n.\nThis package contains the program tricoil (simulation, devices on CAN FD, USB\nand serial lines, servers for FASTRAK and OpenIGTLink clients, live\npage), a simulated front end, device rules and a service.")
set(CPACK_DEBIAN_UNSPECIFIED_PACKAGE_RECOMMENDS "python3-matplotlib, python3-tricoil")
set(CPACK_DEBIAN_UNSPECIFIED_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_SOURCE_DIR}/postinst ${CMAKE_CURRENT_SOURCE_DIR}/prerm ${CMAKE_CURRENT_SOURCE_DIR}/postrm)

set(library_package libtricoil${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
tricoil_debian_package(lib ${library_package} libs "AC electromagnetic tracker: library"
  "${about}\n.\nThis package contains the shared library for C and for languages that\ncall C. It opens a device, a simulation or a recording, and polls poses.")
tricoil_debian_package(dev libtricoil-dev libdevel "AC electromagnetic tracker: development files"
  "${about}\n.\nThis package contains the headers for C and C++, the static libraries, and\nfiles for CMake and pkg-config.")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${library_package} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "libeigen3-dev, libfmt-dev, libtomlplusplus-dev, nlohmann-json3-dev, libusb-1.0-0-dev, libgpiod-dev")

if(TARGET tricoil_python)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  set(python "${Python3_VERSION_MAJOR}.")
  tricoil_debian_package(python python3-tricoil python "AC electromagnetic tracker: Python package"
    "${about}\n.\nThis package gives poses of devices, simulations and recordings, the forward\nmodel, the solver and the error model as NumPy arrays. The program tricoil\nneeds it to calibrate coils and to evaluate trackers.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${python}${Python3_VERSION_MINOR}), python3 (<< ${python}${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-scipy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, python3-distributed, jupyter-notebook")
endif()
include(CPack)
