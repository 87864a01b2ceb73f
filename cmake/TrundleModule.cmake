# How every target of this project is compiled. Floating point is not contracted: a fused multiply-add in one
# place and not in another would make the online step and the batch kernels differ in the last bit.
add_library(trundle_compile_options INTERFACE)
target_compile_features(trundle_compile_options INTERFACE cxx_std_20)
target_compile_options(trundle_compile_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                                         -Wno-sign-conversion -ffp-contract=off)
# To collect garbage in less than 2 GB (twice this, in kB) takes GCC an eighth of its time. Clang-tidy, which is given
# the same options, does not know this one.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CXX_CLANG_TIDY)
  target_compile_options(trundle_compile_options INTERFACE --param=ggc-min-heapsize=1048576)
endif()
if(TRUNDLE_WERROR)
  target_compile_options(trundle_compile_options INTERFACE -Werror)
endif()
set(TRUNDLE_FUZZ OFF)  # libFuzzer comes with clang, and wants sanitizers
if(TRUNDLE_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  set(TRUNDLE_FUZZ ON)
endif()
if(TRUNDLE_SANITIZE)
  # Instrumented code misleads the compiler's flow analysis: those two warnings are false alarms here, and on elsewhere.
  # Null pointers and accesses beyond an object are AddressSanitizer's; checked twice they double the time to compile,
  # and of kernels take ten times as long.
  target_compile_options(trundle_compile_options INTERFACE -fsanitize=address,undefined
                                                           -fno-sanitize=null,alignment,object-size,vptr,pointer-overflow
                                                           -fno-sanitize-recover=all -fno-omit-frame-pointer
                                                           $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized -Wno-restrict>)
  # Under AddressSanitizer Eigen allocates by hand what it takes from malloc elsewhere; Ceres was built without it, and
  # memory that one of the two allocates the other may free.
  target_compile_definitions(trundle_compile_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  target_link_options(trundle_compile_options INTERFACE -fsanitize=address,undefined)
endif()

# trundle_public_headers(header ...)
# names the headers, from src/, that users include: the public API. They are installed, and whatever they include.
function(trundle_public_headers)
  set(queue ${ARGN})
  set(installed)
  while(queue)
    list(POP_FRONT queue header)
    if(header IN_LIST installed)
      continue()
    endif()
    list(APPEND installed ${header})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${header})
    file(STRINGS ${PROJECT_SOURCE_DIR}/src/${header} lines REGEX "^#include \"trundle/")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included "${line}")
      list(APPEND queue ${included})
    endforeach()
  endwhile()
  list(TRANSFORM installed PREPEND ${PROJECT_SOURCE_DIR}/src/)
  set_property(GLOBAL PROPERTY TRUNDLE_INSTALLED_HEADERS ${installed})
endfunction()

# trundle_even_batches(TARGET source ...)
# makes its unity batches alike: of 50 sources not one of 40 and one of 10.
function(trundle_even_batches target)
  list(FILTER ARGN EXCLUDE REGEX "_kernels\\.cpp$")
  list(LENGTH ARGN sources)
  if(sources AND CMAKE_UNITY_BUILD_BATCH_SIZE)
    math(EXPR batches "(${sources} + ${CMAKE_UNITY_BUILD_BATCH_SIZE} - 1) / ${CMAKE_UNITY_BUILD_BATCH_SIZE}")
    math(EXPR size "(${sources} + ${batches} - 1) / ${batches}")
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE ${size})
  endif()
endfunction()

# trundle_keep_installed(OUT_INSTALLED OUT_INTERNAL file ...)
function(trundle_keep_installed out_installed out_internal)
  get_property(all GLOBAL PROPERTY TRUNDLE_INSTALLED_HEADERS)
  set(installed)
  set(internal)
  foreach(file IN LISTS ARGN)
    if(file IN_LIST all)
      list(APPEND installed ${file})
    else()
      list(APPEND internal ${file})
    endif()
  endforeach()
  set(${out_installed} ${installed} PARENT_SCOPE)
  set(${out_internal} ${internal} PARENT_SCOPE)
endfunction()

# trundle_module(NAME [MANY_EIGEN_TYPES] [READS_FILES] DEPENDS modules and libraries ... PRIVATE_DEPENDS libraries ...)
# declares the library trundle::NAME from the folder NAME: all its sources (headers alone are fine). It may depend only on
# modules declared before it. Each of its headers must compile alone (./run lint); those that belong to the public ones
# are installed, and so are the texts that these include, *.inl.
# MANY_EIGEN_TYPES: GCC takes them in batches of 12. Each of Eigen's types names `double` anew, and for each name GCC goes
# through all that there are: batches of 36 and more take 6 % longer than those of 12 then, where others take two thirds
# of their time, and clang three quarters of them all.
# READS_FILES: beside sanitizers libFuzzer sees which branches an input takes (fuzz/). Not in all modules: a comparison in
# an inner loop would be a call.
function(trundle_module name)
  cmake_parse_arguments(arg "MANY_EIGEN_TYPES;READS_FILES" "" "DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  if(arg_MANY_EIGEN_TYPES AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    set(CMAKE_UNITY_BUILD_BATCH_SIZE 12)
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.hpp)
  file(GLOB_RECURSE texts CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.inl)
  # What is compiled once for each instruction set includes itself: not together with other sources.
  set(kernels ${sources})
  list(FILTER kernels INCLUDE REGEX "_kernels\\.cpp$")
  # Checks of memory as calls: inlined, they make a kernel take five times as long to compile. No file is read there.
  set_source_files_properties(${kernels} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON
                              COMPILE_DEFINITIONS "$<$<BOOL:${TRUNDLE_SANITIZE}>:TRUNDLE_FEW_TARGETS>"
                              COMPILE_OPTIONS "$<$<BOOL:${TRUNDLE_FUZZ}>:-mllvm;-asan-instrumentation-with-call-threshold=0;-fno-sanitize=fuzzer-no-link>")
  set(target trundle_${name})
  if(sources)
    add_library(${target} STATIC ${sources})
    target_link_libraries(${target} PRIVATE ${arg_PRIVATE_DEPENDS} $<BUILD_INTERFACE:trundle_compile_options>)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    trundle_even_batches(${target} ${sources})
    if(arg_READS_FILES AND TRUNDLE_FUZZ)
      target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
    endif()
    set(scope PUBLIC)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(trundle::${name} ALIAS ${target})
  trundle_keep_installed(headers internal_headers ${headers})
  trundle_keep_installed(texts internal_texts ${texts})
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${headers}
                                   FILE_SET texts TYPE HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${texts})
  if(internal_headers)
    add_library(${target}_internal INTERFACE)
    target_link_libraries(${target}_internal INTERFACE ${target})
    target_sources(${target}_internal INTERFACE FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src
                                                FILES ${internal_headers})
    set_target_properties(${target}_internal PROPERTIES
                          VERIFY_INTERFACE_HEADER_SETS ${TRUNDLE_VERIFY_INTERNAL_HEADERS})
  endif()
  target_link_libraries(${target} ${scope} ${arg_DEPENDS})
  target_compile_features(${target} ${scope} cxx_std_20)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON
                        INTERFACE_HEADER_SETS_TO_VERIFY HEADERS)
  install(TARGETS ${target} EXPORT trundle_targets
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library
          FILE_SET texts DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
  set_property(GLOBAL APPEND PROPERTY TRUNDLE_MODULES ${name})
endfunction()
