# emtb_version: "emtb/version.h", with the commit that was built.
execute_process(COMMAND git describe --always --dirty --abbrev=12 --exclude=* WORKING_DIRECTORY ${CMAKE_SOURCE_DIR}
                OUTPUT_VARIABLE EMTB_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
configure_file(${CMAKE_SOURCE_DIR}/cmake/version.h.in ${CMAKE_BINARY_DIR}/generated/emtb/version.h @ONLY)
add_library(emtb_version INTERFACE)
target_include_directories(emtb_version INTERFACE ${CMAKE_BINARY_DIR}/generated)
