# `cmake --install`: the command, and geometry and engine as a package:
#   find_package(anticrack REQUIRED)
#   target_link_libraries(mine PRIVATE anticrack::engine)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/anticrack)

foreach(folder IN ITEMS geometry engine)
  set_target_properties(anticrack_${folder} PROPERTIES EXPORT_NAME ${folder})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/anticrack/${folder}
          FILES_MATCHING PATTERN "*.h" PATTERN "*-inl.h" EXCLUDE)
endforeach()
# Link requirements of the two, and nothing to build.
set_target_properties(anticrack_openvdb PROPERTIES EXPORT_NAME openvdb)
set_target_properties(anticrack_flags PROPERTIES EXPORT_NAME flags)
install(TARGETS anticrack_geometry anticrack_engine anticrack_openvdb anticrack_flags EXPORT anticrackTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT anticrackTargets NAMESPACE anticrack:: DESTINATION ${package_folder})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/anticrackConfig.cmake.in ${PROJECT_BINARY_DIR}/anticrackConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/anticrackConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/anticrackConfig.cmake ${PROJECT_BINARY_DIR}/anticrackConfigVersion.cmake
        DESTINATION ${package_folder})

install(TARGETS anticrack RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/assets/scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/anticrack)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
