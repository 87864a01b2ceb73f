# Makes OUT/trundle-VERSION-*.whl of the package that stands in PACKAGE.
# cmake -DPYTHON=... -DSOURCE=<python/> -DPACKAGE=... -DOUT=... -DVERSION=... -P wheel.cmake
cmake_minimum_required(VERSION 3.25)
set(work ${OUT}/wheel)
file(REMOVE_RECURSE ${work})
file(COPY ${SOURCE}/setup.py ${SOURCE}/pyproject.toml ${SOURCE}/README.md DESTINATION ${work})
file(COPY ${PACKAGE} DESTINATION ${work} PATTERN __pycache__ EXCLUDE)
file(GLOB earlier ${OUT}/trundle-*.whl)
if(earlier)
  file(REMOVE ${earlier})
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E env TRUNDLE_VERSION=${VERSION}
                        ${PYTHON} -m pip wheel --quiet --no-index --no-deps --no-build-isolation --wheel-dir ${OUT} ${work}
                RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE said)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${said}")
endif()
