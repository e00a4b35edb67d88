# What `cmake --install` installs besides the libraries and programs: the public headers, and the package that
# find_package(pulson) finds. It may be moved as a whole.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/pulson)
set(parts Targets)
if(PULSON_BUILD_IMAGES)
  list(APPEND parts ImagesTargets)
else()
  set(without_images PATTERN images EXCLUDE)
endif()

install(
  DIRECTORY ${PROJECT_SOURCE_DIR}/include/pulson
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT library
  FILES_MATCHING
  PATTERN "*.hpp" ${without_images})
foreach(part IN LISTS parts)
  install(
    EXPORT pulson${part}
    NAMESPACE pulson::
    DESTINATION ${package_dir}
    COMPONENT library)
endforeach()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/pulsonConfig.cmake.in ${PROJECT_BINARY_DIR}/pulsonConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/pulsonConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(
  FILES ${PROJECT_BINARY_DIR}/pulsonConfig.cmake ${PROJECT_BINARY_DIR}/pulsonConfigVersion.cmake
        ${PROJECT_SOURCE_DIR}/cmake/CeresBlas.cmake
        ${PROJECT_SOURCE_DIR}/cmake/FindCairo.cmake ${PROJECT_SOURCE_DIR}/cmake/FindOpenCVParts.cmake
  DESTINATION ${package_dir}
  COMPONENT library)
