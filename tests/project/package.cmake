# The Debian packages of the built tree: what they contain, what they need, and that they are as Debian wants them.
# Whether apt takes them: tools/package_test.sh.
# cmake -DROOT=<checkout> -DBINARY_DIR=<build tree> -P package.cmake
cmake_minimum_required(VERSION 3.25)
foreach(tool IN ITEMS dpkg-deb dpkg-shlibdeps file)
  find_program(FOUND_${tool} ${tool})
  if(NOT FOUND_${tool})
    message("skipped: no ${tool}")
    return()
  endif()
endforeach()

set(place ${BINARY_DIR}/package_test)
file(REMOVE_RECURSE ${place})
set(run OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_CPACK_COMMAND} --config ${BINARY_DIR}/CPackConfig.cmake -B ${place}
                        -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip ${run})  # quicker than xz

# check_package(NAME CONTROL patterns of its fields ... FILES patterns of its files ...)
function(check_package name)
  cmake_parse_arguments(arg "" "" "CONTROL;FILES" ${ARGN})
  file(GLOB package ${place}/${name}_*.deb)
  execute_process(COMMAND dpkg-deb --field ${package} ${run})
  foreach(pattern IN LISTS arg_CONTROL ITEMS "Maintainer: .+ <.+@.+>" "Priority: optional")
    if(NOT "\n${printed}" MATCHES "\n${pattern}\n")
      message(FATAL_ERROR "${name} has no control field '${pattern}':\n${printed}")
    endif()
  endforeach()
  execute_process(COMMAND dpkg-deb --contents ${package} ${run})
  foreach(file IN LISTS arg_FILES ITEMS "share/doc/${name}/copyright" "share/doc/${name}/changelog.Debian.gz")
    if(NOT printed MATCHES " \\./usr/${file}\n")
      message(FATAL_ERROR "${name} has no /usr/${file}:\n${printed}")
    endif()
  endforeach()
  # All of it is root's and in /usr; only programs are executed.
  string(REGEX REPLACE "(drwxr-xr-x|-rw-r--r--) root/root [^\n]+ \\./usr/[^\n]*\n" "" unusual "${printed}")
  string(REGEX REPLACE "-rwxr-xr-x root/root [^\n]+ \\./usr/bin/[^\n]*\n" "" unusual "${unusual}")
  if(NOT unusual STREQUAL "")
    message(FATAL_ERROR "${name} has files of an unusual place, owner or mode:\n${unusual}")
  endif()
  execute_process(COMMAND dpkg-deb --ctrl-tarfile ${package} COMMAND tar --list ${run})
  if(NOT printed MATCHES "md5sums")
    message(FATAL_ERROR "${name} has no md5sums:\n${printed}")
  endif()
endfunction()

check_package(trundle
  CONTROL "Section: science" "Depends: [^\n]*libc6 [^\n]*libstdc\\+\\+6[^\n]*" "Description: [a-z][^\n]*\n Trundle .*"
  FILES bin/trundle share/man/man1/trundle.1.gz share/bash-completion/completions/trundle
        share/zsh/vendor-completions/_trundle share/fish/vendor_completions.d/trundle.fish
        share/doc/trundle/changelog.gz share/doc/trundle/README.md)
file(GLOB package ${place}/trundle_*.deb)
execute_process(COMMAND dpkg-deb --field ${package} Depends ${run})
if(printed MATCHES "-dev")
  message(FATAL_ERROR "The program needs what only compilers need: ${printed}")
endif()
check_package(libtrundle-dev
  CONTROL "Section: libdevel" "Depends: [^\n]*libeigen3-dev[^\n]*" "Description: [a-z][^\n]*\n Trundle .*"
  FILES lib/libtrundle_odometry.a include/trundle/odometry/odometer.hpp lib/cmake/trundle/trundle-config.cmake
        lib/cmake/trundle/trundle_targets.cmake)

# What the CMake package looks for is what libtrundle-dev depends on. Debian's names have other hyphens, and one is another.
function(as_debian_says name result)
  string(TOLOWER "${name}" name)
  string(REGEX REPLACE "[-_]" "" name "${name}")
  string(REPLACE openssl libssl name "${name}")
  string(REPLACE bzip2 libbz2 name "${name}")
  set(${result} ${name} PARENT_SCOPE)
endfunction()
file(GLOB package ${place}/libtrundle-dev_*.deb)
execute_process(COMMAND dpkg-deb --field ${package} Depends ${run})
as_debian_says("${printed}" depends)
file(STRINGS ${ROOT}/cmake/trundle-config.cmake.in lines REGEX "find_dependency\\(|pkg_check_modules\\(")
list(FILTER lines EXCLUDE REGEX "Threads")  # of the C library
foreach(line IN LISTS lines)
  string(REGEX MATCH "find_dependency\\(([^ )]+)|IMPORTED_TARGET ([^ )]+)" matched "${line}")
  as_debian_says("${CMAKE_MATCH_1}${CMAKE_MATCH_2}" wanted)
  string(FIND "${depends}" "${wanted}" found)
  if(found EQUAL -1)
    message(FATAL_ERROR "libtrundle-dev does not depend on what trundle-config.cmake looks for, ${matched}: ${printed}")
  endif()
endforeach()
