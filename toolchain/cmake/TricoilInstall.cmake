# What `cmake --install` puts where, in two components, and the Debian package of the program (cpack -G DEB).
#   program: tricoil, its man page, completion, udev rules, systemd unit and user, an example configuration
#   library: headers and archive of core and hal, for CMake (find_package(tricoil)) and pkg-config
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS tricoil RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(FILES board/host/system/tricoil.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES board/host/system/tricoil.bash RENAME tricoil DESTINATION share/bash-completion/completions COMPONENT program)
install(FILES board/linux/system/70-tricoil.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES board/linux/system/tricoil.service DESTINATION lib/systemd/system COMPONENT program)
install(FILES board/host/system/tricoil.sysusers RENAME tricoil.conf DESTINATION lib/sysusers.d COMPONENT program)
install(FILES board/linux/system/board.toml README.md LICENSE DESTINATION share/doc/tricoil COMPONENT program)

set_target_properties(tricoil_core PROPERTIES EXPORT_NAME core)
set_target_properties(tricoil_hal PROPERTIES EXPORT_NAME hal)
install(TARGETS tricoil_core tricoil_hal EXPORT tricoilTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library)
install(DIRECTORY core hal DESTINATION include/tricoil COMPONENT library FILES_MATCHING PATTERN "*.hpp")
install(EXPORT tricoilTargets NAMESPACE tricoil:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tricoil COMPONENT library)
configure_package_config_file(toolchain/cmake/tricoilConfig.cmake.in tricoilConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tricoil)
write_basic_package_version_file(tricoilConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/tricoilConfig.cmake ${PROJECT_BINARY_DIR}/tricoilConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tricoil COMPONENT library)
file(RELATIVE_PATH TRICOIL_PREFIX_FROM_PC /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(toolchain/cmake/tricoil.pc.in tricoil.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/tricoil.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT library)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the tricoil developers <tricoil@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME tricoil)
set(CPACK_DEBIAN_PROGRAM_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS gnuplot-nox)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/board/host/system/postinst)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
include(CPack)
