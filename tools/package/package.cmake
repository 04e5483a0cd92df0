# Debian packages by CPack: tools/package/build makes them. `cmake --install` alone installs neither the service nor its settings.
set(package_files ${CMAKE_CURRENT_LIST_DIR})
set(made_files ${CMAKE_BINARY_DIR}/package)  # by tools/package/build
set(doc ${CMAKE_INSTALL_DATADIR}/doc)

install(FILES ${package_files}/parhelion.service DESTINATION lib/systemd/system COMPONENT program EXCLUDE_FROM_ALL)
install(FILES ${package_files}/parhelion.sysusers RENAME parhelion.conf
  DESTINATION lib/sysusers.d COMPONENT program EXCLUDE_FROM_ALL)
install(FILES ${CMAKE_SOURCE_DIR}/tools/sysctl.d/60-parhelion.conf
  DESTINATION lib/sysctl.d COMPONENT program EXCLUDE_FROM_ALL)
install(FILES ${package_files}/parhelion.env DESTINATION /etc/parhelion COMPONENT program EXCLUDE_FROM_ALL)
install(FILES ${made_files}/parhelion.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program EXCLUDE_FROM_ALL)
install(FILES ${made_files}/parhelion.spdx.json ${CMAKE_SOURCE_DIR}/docs/run-as-a-service.md
  DESTINATION ${doc}/parhelion COMPONENT program EXCLUDE_FROM_ALL)
foreach(component program data)
  string(REPLACE program parhelion package ${component})
  string(REPLACE data parhelion-data package ${package})
  install(FILES ${package_files}/copyright ${made_files}/changelog.gz
    DESTINATION ${doc}/${package} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON)  # for /etc
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PACKAGE_CONTACT "The Parhelion authors <parhelion@parhelion.invalid>")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL program data)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME parhelion)
set(CPACK_DEBIAN_PROGRAM_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
# EGL and OpenGL ES are loaded at run time, so dpkg-shlibdeps does not see them. sysusers.d makes the service's user.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "parhelion-data (= ${PROJECT_VERSION}), libegl1, libgles2, libegl-mesa0, \
libgl1-mesa-dri, passwd, systemd-standalone-sysusers | systemd-sysusers")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS mrpt-common)  # the recording that `parhelion demo` plays
set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_EXTRA
  ${package_files}/postinst ${package_files}/prerm ${package_files}/postrm ${package_files}/conffiles)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "mixed-reality server for training operators of mobile robots
Parhelion puts virtual robots, people and obstacles beside a real robot: into
its laser scans, point clouds, depth images and video, hidden behind what is
really in front of them. Operators train on the real machine, or first on a
simulated one in a model of the real site, and are graded. It speaks LCM and
comes with a base station for browsers.

The service parhelion.service has to be configured in /etc/parhelion, and is
not enabled by this package.")

set(CPACK_DEBIAN_DATA_PACKAGE_NAME parhelion-data)
set(CPACK_DEBIAN_DATA_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_DATA_PACKAGE_SECTION science)
set(CPACK_DEBIAN_DATA_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_DATA_DESCRIPTION "robots, scenarios and presets of Parhelion
Parhelion is a mixed-reality server for training operators of mobile robots.

This package has its simulated robots, training programmes, lanes after the
standard test methods for response robots, and presets of laser scanners.")
include(CPack)
