# Debian's libopencv-core-dev and -imgproc-dev, which have no config file: OpenCVConfig.cmake is in
# libopencv-dev alone, with all the other modules (1000 MB). Defines OpenCVParts::core and ::imgproc.
find_path(
  OpenCVParts_INCLUDE_DIR
  NAMES opencv2/core.hpp
  PATH_SUFFIXES opencv4)
foreach(part core imgproc)
  find_library(OpenCVParts_${part}_LIBRARY NAMES opencv_${part})
  mark_as_advanced(OpenCVParts_${part}_LIBRARY)
endforeach()
mark_as_advanced(OpenCVParts_INCLUDE_DIR)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  OpenCVParts
  REQUIRED_VARS OpenCVParts_core_LIBRARY OpenCVParts_imgproc_LIBRARY OpenCVParts_INCLUDE_DIR)

if(OpenCVParts_FOUND)
  foreach(part core imgproc)
    if(NOT TARGET OpenCVParts::${part})
      # The headers of an imported target are system headers.
      add_library(OpenCVParts::${part} UNKNOWN IMPORTED)
      set_target_properties(
        OpenCVParts::${part} PROPERTIES IMPORTED_LOCATION ${OpenCVParts_${part}_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES
                                                                                         ${OpenCVParts_INCLUDE_DIR})
    endif()
  endforeach()
  target_link_libraries(OpenCVParts::imgproc INTERFACE OpenCVParts::core)
endif()
