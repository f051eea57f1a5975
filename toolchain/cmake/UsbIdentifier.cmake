# USB identifier of tracker boards. Image, host program and udev rules of one build have the same.
set(TRICOIL_USB_ID 1209:0001 CACHE STRING "USB vendor and product of tracker boards, hexadecimal; 1209:0001 is for tests, a product needs its own")
string(TOLOWER "${TRICOIL_USB_ID}" id)
if(NOT id MATCHES "^([0-9a-f][0-9a-f][0-9a-f][0-9a-f]):([0-9a-f][0-9a-f][0-9a-f][0-9a-f])$")
  message(FATAL_ERROR "TRICOIL_USB_ID ${TRICOIL_USB_ID}: must be VENDOR:PRODUCT, each of four hexadecimal digits, as in 1209:0001")
endif()
set(TRICOIL_USB_VENDOR ${CMAKE_MATCH_1})
set(TRICOIL_USB_PRODUCT ${CMAKE_MATCH_2})
if(NOT id STREQUAL 1209:0001)
  add_compile_definitions(TRICOIL_USB_VENDOR=0x${TRICOIL_USB_VENDOR} TRICOIL_USB_PRODUCT=0x${TRICOIL_USB_PRODUCT})
endif()

# tricoil_usb_rules(FROM TO): udev rules with this identifier.
function(tricoil_usb_rules from to)
  file(READ ${from} rules)
  string(REPLACE "{idVendor}==\"1209\"" "{idVendor}==\"${TRICOIL_USB_VENDOR}\"" rules "${rules}")
  string(REPLACE "{idProduct}==\"0001\"" "{idProduct}==\"${TRICOIL_USB_PRODUCT}\"" rules "${rules}")
  file(CONFIGURE OUTPUT ${to} CONTENT "${rules}" @ONLY)
endfunction()
