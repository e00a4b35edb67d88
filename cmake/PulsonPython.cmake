# Whether the Python module can be built, PULSON_PYTHON_IS_FOUND: where something is missing it is left out with a word.
# Before the libraries, which then are compiled for a shared object, too: the module and the program are of the same code.
set(PULSON_PYTHON_IS_FOUND OFF)
if(PULSON_BUILD_PYTHON AND PULSON_BUILD_PROGRAMS)
  if(NOT DEFINED Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python3_EXECUTABLE /usr/bin/python3) # the one of python3-dev and python3-numpy
  endif()
  find_package(Python3 COMPONENTS Interpreter Development.Module NumPy)
  find_package(pybind11 2.10 CONFIG QUIET)
  if(Python3_FOUND AND pybind11_FOUND)
    set(PULSON_PYTHON_IS_FOUND ON)
    set(CMAKE_POSITION_INDEPENDENT_CODE ON)
    # Functions stay inlined as they are in a program's code.
    target_compile_options(pulson_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
  else()
    message(STATUS "Without the Python module: it needs python3-dev, python3-numpy and pybind11-dev")
  endif()
endif()
