# Debian's libcairo2-dev, which has no config file, with the fonts that it draws in. Defines Cairo::cairo.
find_package(Freetype QUIET)
find_package(Fontconfig QUIET)
find_path(
  Cairo_INCLUDE_DIR
  NAMES cairo-ft.h
  PATH_SUFFIXES cairo)
find_library(Cairo_LIBRARY NAMES cairo)
mark_as_advanced(Cairo_INCLUDE_DIR Cairo_LIBRARY)
if(EXISTS "${Cairo_INCLUDE_DIR}/cairo-version.h")
  file(STRINGS ${Cairo_INCLUDE_DIR}/cairo-version.h Cairo_VERSION REGEX "define CAIRO_VERSION_(MAJOR|MINOR|MICRO)")
  string(REGEX MATCHALL "[0-9]+" Cairo_VERSION "${Cairo_VERSION}")
  list(JOIN Cairo_VERSION "." Cairo_VERSION)
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  Cairo
  REQUIRED_VARS Cairo_LIBRARY Cairo_INCLUDE_DIR FREETYPE_FOUND Fontconfig_FOUND
  VERSION_VAR Cairo_VERSION)

if(Cairo_FOUND AND NOT TARGET Cairo::cairo)
  add_library(Cairo::cairo UNKNOWN IMPORTED)
  set_target_properties(
    Cairo::cairo
    PROPERTIES IMPORTED_LOCATION ${Cairo_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${Cairo_INCLUDE_DIR}
               INTERFACE_LINK_LIBRARIES "Fontconfig::Fontconfig;Freetype::Freetype")
endif()
