# One target per folder: the LINK lists of src/*/CMakeLists.txt and apps/ are the architecture.

# Compiler options that every target of ours shares.
add_library(pulson_options INTERFACE)
target_compile_features(pulson_options INTERFACE cxx_std_20)
target_compile_options(
  pulson_options
  INTERFACE -Wall
            -Wextra
            -Wpedantic
            -Wshadow
            -Wconversion
            -Wno-sign-conversion
            -Wno-error=invalid-pch # then headers are read as they are
            # The compiler collects its garbage from 400 MB on: a quarter less time.
            $<$<AND:$<BOOL:${PULSON_UNITY}>,$<CXX_COMPILER_ID:GNU>>:--param=ggc-min-expand=400>
            $<$<AND:$<BOOL:${PULSON_UNITY}>,$<CXX_COMPILER_ID:GNU>>:--param=ggc-min-heapsize=400000>
            $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> # false alarms of g++ 12 on std::string (its bug 105651)
            $<$<BOOL:${PULSON_WARNINGS_AS_ERRORS}>:-Werror>)

# The sanitizers' checks give g++ false alarms of this, which preset dev looks for.
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  target_compile_options(pulson_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()

# Eigen's products of matrices by BLAS, in all of our code or in none: the linker keeps one of several equal names. It is
# no property of our targets, so what a program that links them compiles stays as it is; see docs/linking.md.
target_compile_definitions(pulson_options INTERFACE EIGEN_USE_BLAS)

# For a build that stays on this machine: a fifth of the compile time of vector code for each of the others. In all of our
# code or in none.
option(PULSON_NATIVE_VECTORS "Compile vector code for this machine's instructions alone" OFF)
if(PULSON_NATIVE_VECTORS)
  file(WRITE ${PROJECT_BINARY_DIR}/native_target.cpp
       "#include <cstdio>\n#include <hwy/targets.h>\n"
       "int main() { std::printf(\"%d\", __builtin_ctzll(hwy::SupportedTargets() & HWY_TARGETS)); }\n")
  try_run(
    PULSON_NATIVE_RUNS PULSON_NATIVE_COMPILES ${PROJECT_BINARY_DIR}/native_target
    ${PROJECT_BINARY_DIR}/native_target.cpp
    LINK_LIBRARIES hwy::hwy
    RUN_OUTPUT_VARIABLE native_target)
  # Scalar code is the base of the choice at run time, and remains.
  target_compile_definitions(pulson_options
                             INTERFACE "HWY_DISABLED_TARGETS=(~(1LL<<${native_target}|HWY_SCALAR|HWY_EMU128))")
else()
  # SSSE3 alone is of few machines.
  target_compile_definitions(pulson_options INTERFACE HWY_DISABLED_TARGETS=HWY_SSSE3)
endif()

# The headers that most files include, parsed once: a third of the time of a build from nothing. ccache, which does not
# see into them, does without.
option(PULSON_PRECOMPILED_HEADERS "Parse common headers once" ON)
if(CMAKE_CXX_COMPILER_LAUNCHER)
  set(PULSON_PRECOMPILED_HEADERS OFF)
endif()

# The files of a target compiled thirty-two at a time, so that what they share of templates is made once: a build from
# nothing takes a third less time, but each change compiles more of it again. Names within one target must differ for it,
# those in unnamed namespaces, too.
option(PULSON_UNITY "Compile the files of a target together" OFF)
if(PULSON_UNITY)
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 32)
endif()

# Tests spend their time in the libraries; with less optimisation of their own they compile a fifth faster, and those that
# compute nothing themselves, of the kind text_test, by another fifth without any. So do the verbs and the folders that
# read, write and draw, of the kind app.
# g++ 12 takes members of Eigen's matrices for uninitialised at -O1.
set(PULSON_OPTIONS_test $<$<NOT:$<CONFIG:Debug>>:-O1> -Wno-maybe-uninitialized)
set(PULSON_OPTIONS_text_test -O0)
set(PULSON_OPTIONS_app $<$<NOT:$<CONFIG:Debug>>:-O1> -Wno-maybe-uninitialized)

# Of the checks for undefined behaviour those of alignment and of dynamic types are the dearest: a third of the time of tests,
# a sixth of that of libraries. Misaligned pointers come of casts of bytes: the former are of the folders that read and
# write these. Tests do without both, but for those of the address sanitizer and all others of undefined behaviour.
set(PULSON_FOLDERS_OF_BYTES fields formats images records)
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  list(APPEND PULSON_OPTIONS_test -fno-sanitize=alignment,vptr)
  list(APPEND PULSON_OPTIONS_text_test -fno-sanitize=alignment,vptr)
endif()

# The headers that most files of this kind include; not CLI11's and nlohmann's, with which precompiled ones are slower
# than none.
set(PULSON_APP_HEADERS <algorithm> <cmath> <functional> <memory> <optional> <string> <vector> <Eigen/Core> <fmt/format.h>
                       <fmt/ranges.h>)

# pulson_compile_as(<target> <kind> <headers...>): with the options of the kind, and its precompiled headers, which the
# first target of a kind makes and the others take from it. Kinds: source, app, test, and text_test. The macros of a command must be those of the headers: fmt's are in sources
# and apps alone.
function(pulson_compile_as target kind)
  target_compile_options(${target} PRIVATE ${PULSON_OPTIONS_${kind}})
  # That of executables is another than that of libraries, and precompiled headers are of one: the compiler's default.
  if(kind MATCHES "test")
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  endif()
  if(NOT PULSON_PRECOMPILED_HEADERS)
    return()
  endif()
  set(packages_source fmt::fmt)
  set(packages_app fmt::fmt)
  set(packages_test GTest::gtest GTest::gmock)
  set(packages_text_test GTest::gtest GTest::gmock)
  if(NOT TARGET pulson_headers_${kind})
    file(WRITE ${PROJECT_BINARY_DIR}/headers_${kind}.cpp "")
    add_library(pulson_headers_${kind} OBJECT ${PROJECT_BINARY_DIR}/headers_${kind}.cpp)
    target_link_libraries(pulson_headers_${kind} PRIVATE pulson_options Eigen3::Eigen Threads::Threads ${packages_${kind}})
    target_compile_options(pulson_headers_${kind} PRIVATE ${PULSON_OPTIONS_${kind}})
    if(kind MATCHES "test")
      set_target_properties(pulson_headers_${kind} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    endif()
    target_precompile_headers(pulson_headers_${kind} PRIVATE ${ARGN})
  endif()
  target_precompile_headers(${target} REUSE_FROM pulson_headers_${kind})
endfunction()

# pulson_vector_source(<file>): its loops over axes and rounds must unroll in every preset, but for the sanitizers', which
# take ten minutes over that, and over the checks for undefined behaviour in every vector operation. The address sanitizer
# looks at memory by calls there rather than in place, as functions are long: landmark_lanes.cpp, pair_lanes.cpp and
# pair_sums.cpp compile in 47, 36 and 50 CPU s (166, 94 and 117 in place), and the tests of the last take 31 rather than
# 25. (From precompiled headers, which these do without, g++ would take such parameters, too.)
function(pulson_vector_source file)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(options -fno-sanitize=undefined)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      list(APPEND options --param=asan-instrumentation-with-call-threshold=0)
    endif()
    set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "${options}" SKIP_PRECOMPILE_HEADERS ON)
  else()
    set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "-O3" SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# A build with other flags may take the libraries of all folders but some from a build that is there: PULSON_PREBUILT
# is its folder, PULSON_PREBUILT_EXCEPT names those that are compiled. The fuzzers' build does so.
function(pulson_take_prebuilt folder)
  set(prebuilt ${PULSON_PREBUILT}/src/${folder}/libpulson_${folder}.a)
  set(empty ${CMAKE_CURRENT_BINARY_DIR}/prebuilt.cpp)
  file(TOUCH ${empty})
  set_source_files_properties(${empty} PROPERTIES OBJECT_DEPENDS ${prebuilt} SKIP_PRECOMPILE_HEADERS ON)
  add_library(pulson_${folder} STATIC ${empty})
  add_custom_command(TARGET pulson_${folder} POST_BUILD
                     COMMAND ${CMAKE_COMMAND} -E copy ${prebuilt} $<TARGET_FILE:pulson_${folder}>)
endfunction()

# pulson_library(<folder> [PROGRAMS_ONLY] [APP] SOURCES <files...> [PUBLIC <targets...>] [PRIVATE <targets...>] [EXPORT <set>])
# makes the static library pulson_<folder> with the alias pulson::<folder>, which an installed package has too. PUBLIC:
# what its headers include; PRIVATE: what its .cpp files alone use. Headers of other packages count as system headers.
# Private headers of other folders are named from src/: "core/text.hpp".
# PROGRAMS_ONLY: it has no public headers and is not installed.
# APP: it computes next to nothing, and is compiled as the verbs are.
# EXPORT: the package's list of targets that it belongs to [pulsonTargets].
function(pulson_library folder)
  cmake_parse_arguments(ARG "PROGRAMS_ONLY;APP" "EXPORT" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(PULSON_PREBUILT AND NOT folder IN_LIST PULSON_PREBUILT_EXCEPT)
    pulson_take_prebuilt(${folder})
  else()
    add_library(pulson_${folder} STATIC ${ARG_SOURCES})
  endif()
  add_library(pulson::${folder} ALIAS pulson_${folder})
  # Headers of src/ that folders share, "core/atomic_file.hpp", are named from there.
  target_include_directories(
    pulson_${folder}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_compile_features(pulson_${folder} PUBLIC cxx_std_20)
  set_target_properties(pulson_${folder} PROPERTIES EXPORT_NAME ${folder})
  target_link_libraries(
    pulson_${folder}
    PUBLIC ${ARG_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:pulson_options> ${ARG_PRIVATE})
  if(ARG_APP)
    pulson_compile_as(pulson_${folder} app ${PULSON_APP_HEADERS})
  elseif(fmt::fmt IN_LIST ARG_PRIVATE)
    pulson_compile_as(
      pulson_${folder} source <algorithm> <cmath> <functional> <map> <memory> <optional> <string> <vector>
      <Eigen/Core> <fmt/format.h> <fmt/ranges.h> ${PROJECT_SOURCE_DIR}/src/core/factorisations.hpp)
  endif()
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize" AND NOT folder IN_LIST PULSON_FOLDERS_OF_BYTES)
    target_compile_options(pulson_${folder} PRIVATE -fno-sanitize=alignment)
  endif()
  if(NOT ARG_EXPORT)
    set(ARG_EXPORT pulsonTargets)
  endif()
  if(NOT ARG_PROGRAMS_ONLY)
    pulson_install(pulson_${folder} ${ARG_EXPORT})
  endif()
endfunction()

# pulson_install(<library> <export set>)
function(pulson_install library set)
  if(NOT PULSON_INSTALL)
    return()
  endif()
  install(
    TARGETS ${library}
    EXPORT ${set}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library
    INCLUDES
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endfunction()
