# The project speaks of itself alone: no path of one machine, no host that serves packages to one network.
# cmake -DROOT=<checkout> -P itself_alone.cmake
cmake_minimum_required(VERSION 3.25)
find_package(Git QUIET)
if(NOT Git_FOUND OR NOT EXISTS ${ROOT}/.git)
  message("skipped: not a git checkout")
  return()
endif()
set(machine_path "(^|[^A-Za-z0-9_./-])/(work|home|root|Users)/")
set(package_host "https?://[A-Za-z0-9.-]*(registry|npmjs|pypi|artifactory|nexus)[A-Za-z0-9.-]*")
execute_process(COMMAND ${GIT_EXECUTABLE} grep -nIE "${machine_path}|${package_host}"
                WORKING_DIRECTORY ${ROOT} RESULT_VARIABLE result OUTPUT_VARIABLE found)
if(result EQUAL 0)
  message(FATAL_ERROR "Names a machine or a network, not the project:\n${found}")
elseif(NOT result EQUAL 1)
  message(FATAL_ERROR "git grep failed")
endif()
