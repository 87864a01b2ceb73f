// Nothing but what CMake puts before it: target_precompile_headers in CMakeLists.txt.
