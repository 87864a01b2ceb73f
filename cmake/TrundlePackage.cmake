# Debian packages of what is installed: `trundle`, the program, and `libtrundle-dev`, the library. Two, because who
# runs the program needs no Eigen, and who builds against the library needs all that its CMake package looks for.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The Trundle authors <trundle@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/package)
set(CPACK_COMPONENTS_ALL program library)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS  # whatever the umask
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(description "Trundle turns what a wheeled robot's own sensors recorded into numbers that
can be trusted: calibrated wheels with error bars, slip found and corrected,
a trajectory with its covariance, a map of landmarks. Any number of fixed,
skid-steer, omni or mecanum wheels, passive pods and a gyro are described in
one file; recordings are CSV files as they are.
.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME trundle)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "calibration, slip, odometry and SLAM of wheeled robots
${description}
This package has the program; libtrundle-dev has the same as a C++ library.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libtrundle-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
# What trundle-config.cmake looks for: without one of these find_package(trundle) fails.
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS
    "libbz2-dev, libeigen3-dev (>= 3.4), libfmt-dev, libhwy-dev, liblz4-dev, libsqlite3-dev, libssl-dev, libtomlplusplus-dev, libzstd-dev, nlohmann-json3-dev, pkg-config")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SUGGESTS "cmake, g++, trundle")
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "calibration, slip, odometry and SLAM of wheeled robots (C++ library)
${description}
This package has the static library, its headers and its CMake package:
find_package(trundle), trundle::trundle.")

# The documentation is for every installation; what only Debian asks for goes into its packages alone: EXCLUDE_FROM_ALL.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/trundle COMPONENT program)

set(debian ${PROJECT_BINARY_DIR}/debian)
file(TIMESTAMP ${PROJECT_SOURCE_DIR}/CHANGELOG.md date "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${debian}/changelog COPYONLY)

# trundle_debian_documents(COMPONENT PACKAGE documents ...) adds these and those that every package has.
function(trundle_debian_documents component package)
  set(changelog ${debian}/${package}/changelog.Debian)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/debian/changelog.in ${changelog} @ONLY)
  set(documents ${changelog} ${ARGN})
  execute_process(COMMAND ${GZIP} --best --no-name --keep --force ${documents} COMMAND_ERROR_IS_FATAL ANY)
  list(TRANSFORM documents APPEND .gz)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian/copyright ${documents}
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component} EXCLUDE_FROM_ALL)
endfunction()
trundle_debian_documents(program trundle ${debian}/changelog)
trundle_debian_documents(library libtrundle-dev)

include(CPack)
