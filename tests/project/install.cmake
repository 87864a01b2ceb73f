# What a user of the library does: install it, find_package(trundle), build against it, run.
# cmake -DBINARY_DIR= -DCONSUMER= -DEXAMPLES= -DCOMPILER= -DEXPECTED= -P install.cmake
cmake_minimum_required(VERSION 3.25)
set(place ${BINARY_DIR}/installed)
file(REMOVE_RECURSE ${place}/prefix)
set(run COMMAND_ERROR_IS_FATAL ANY OUTPUT_VARIABLE output)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BINARY_DIR} --prefix ${place}/prefix ${run})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${CONSUMER} -B ${place}/consumer -G Ninja --fresh
                        -DCMAKE_PREFIX_PATH=${place}/prefix -DCMAKE_CXX_COMPILER=${COMPILER} ${run})
execute_process(COMMAND ${CMAKE_COMMAND} --build ${place}/consumer ${run})
execute_process(COMMAND ${place}/consumer/consumer ${run})
if(NOT output STREQUAL "${EXPECTED}\n")
  message(FATAL_ERROR "The consumer printed '${output}' and not '${EXPECTED}'")
endif()
execute_process(COMMAND ${place}/prefix/bin/trundle --version ${run})
# The examples are such projects too: two, for all of them are compiled in the build tree.
execute_process(COMMAND ${CMAKE_COMMAND} -S ${EXAMPLES} -B ${place}/examples -G Ninja --fresh
                        -DCMAKE_PREFIX_PATH=${place}/prefix -DCMAKE_CXX_COMPILER=${COMPILER} ${run})
execute_process(COMMAND ${CMAKE_COMMAND} --build ${place}/examples --target example_calibrate example_slip ${run})
# And they run: what they compute, the tests of the app hold against the truth.
set(sample ${EXAMPLES}/../data/demo)
execute_process(COMMAND ${place}/examples/example_calibrate ${sample}/robot.toml ${place}/calibrated.toml
                        ${sample}/session_01 ${sample}/session_03 ${run})
execute_process(COMMAND ${place}/examples/example_slip ${place}/calibrated.toml ${sample}/slip ${run})
if(NOT output MATCHES "spin.*corrected: x")
  message(FATAL_ERROR "The example printed '${output}'")
endif()
