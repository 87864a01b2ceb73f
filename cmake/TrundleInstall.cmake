include(CMakePackageConfigHelpers)
install(EXPORT trundle_targets NAMESPACE trundle:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trundle
        COMPONENT library)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/trundle-config.cmake.in trundle-config.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trundle)
write_basic_package_version_file(trundle-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/trundle-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/trundle-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/trundle COMPONENT library)
