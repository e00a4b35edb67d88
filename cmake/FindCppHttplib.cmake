# Debian's libcpp-httplib-dev, which has no config file for CMake. It is compiled with these definitions, on which the layout of
# its classes depends. Defines CppHttplib::cpp-httplib.
find_package(OpenSSL QUIET)
find_package(ZLIB QUIET)
find_path(CppHttplib_INCLUDE_DIR NAMES httplib.h)
find_path(Brotli_INCLUDE_DIR NAMES brotli/encode.h)
find_library(CppHttplib_LIBRARY NAMES cpp-httplib)
mark_as_advanced(CppHttplib_INCLUDE_DIR Brotli_INCLUDE_DIR CppHttplib_LIBRARY)
if(EXISTS "${CppHttplib_INCLUDE_DIR}/httplib.h")
  file(STRINGS ${CppHttplib_INCLUDE_DIR}/httplib.h CppHttplib_VERSION REGEX "define CPPHTTPLIB_VERSION ")
  string(REGEX MATCH "[0-9.]+" CppHttplib_VERSION "${CppHttplib_VERSION}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  CppHttplib
  REQUIRED_VARS CppHttplib_LIBRARY CppHttplib_INCLUDE_DIR Brotli_INCLUDE_DIR OPENSSL_FOUND ZLIB_FOUND
  VERSION_VAR CppHttplib_VERSION)

if(CppHttplib_FOUND AND NOT TARGET CppHttplib::cpp-httplib)
  add_library(CppHttplib::cpp-httplib UNKNOWN IMPORTED)
  set_target_properties(
    CppHttplib::cpp-httplib
    PROPERTIES IMPORTED_LOCATION ${CppHttplib_LIBRARY}
               INTERFACE_INCLUDE_DIRECTORIES "${CppHttplib_INCLUDE_DIR};${Brotli_INCLUDE_DIR};${OPENSSL_INCLUDE_DIR}"
               INTERFACE_COMPILE_DEFINITIONS
               "CPPHTTPLIB_OPENSSL_SUPPORT;CPPHTTPLIB_ZLIB_SUPPORT;CPPHTTPLIB_BROTLI_SUPPORT")
endif()
