# Debian's Ceres names every BLAS that it was built with (the system's, ATLAS's), and programs would take these before
# BLAS::BLAS, which SerialBlas keeps to one thread. A program has one.
get_target_property(_pulson_libraries Ceres::ceres INTERFACE_LINK_LIBRARIES)
list(FILTER _pulson_libraries EXCLUDE REGEX "/lib(f77)?blas\\.|/libatlas\\.")
set_target_properties(Ceres::ceres PROPERTIES INTERFACE_LINK_LIBRARIES "${_pulson_libraries};BLAS::BLAS")
unset(_pulson_libraries)
