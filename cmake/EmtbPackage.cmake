# What `cmake --install` puts where, and the Debian package that `cpack -G DEB` makes of it in the build folder.
include(GNUInstallDirs)
set(EMTB_PACKAGING ${CMAKE_SOURCE_DIR}/packaging)
set(EMTB_MADE ${CMAKE_BINARY_DIR}/packaging)
file(MAKE_DIRECTORY ${EMTB_MADE})

# The manual and the completions are written by the programs themselves: from the tree that parses the command line.
set(made "")
file(GLOB profiles CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/config/profiles/*.yaml)  # the completions name them
foreach(kind man bash zsh)
  add_custom_command(OUTPUT ${EMTB_MADE}/emtb.${kind} COMMAND emtb help --as ${kind} > ${EMTB_MADE}/emtb.${kind} DEPENDS emtb ${profiles} VERBATIM)
  list(APPEND made ${EMTB_MADE}/emtb.${kind})
endforeach()
foreach(program emtbd emtb-safe emtb-plant)
  add_custom_command(
    OUTPUT ${EMTB_MADE}/${program}.8
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}> -DNAME=${program} -DVERSION=${PROJECT_VERSION} -DOUT=${EMTB_MADE}/${program}.8
            -P ${EMTB_PACKAGING}/man_page.cmake
    DEPENDS ${program} ${EMTB_PACKAGING}/man_page.cmake VERBATIM)
  list(APPEND made ${EMTB_MADE}/${program}.8)
endforeach()
foreach(page emtb.man emtbd.8 emtb-safe.8 emtb-plant.8)
  add_custom_command(OUTPUT ${EMTB_MADE}/${page}.gz COMMAND gzip -9nc ${EMTB_MADE}/${page} > ${EMTB_MADE}/${page}.gz
                     DEPENDS ${EMTB_MADE}/${page} VERBATIM)
  list(APPEND made ${EMTB_MADE}/${page}.gz)
endforeach()
add_custom_target(emtb_manual ALL DEPENDS ${made})

install(TARGETS emtb emtbd emtb-safe emtb-plant RUNTIME DESTINATION bin)
install(DIRECTORY config/benches config/devices config/models config/profiles config/mappings config/candidates DESTINATION share/emtb)
install(FILES config/bench.schema.json DESTINATION share/emtb)
install(FILES ${EMTB_MADE}/emtb.man.gz DESTINATION share/man/man1 RENAME emtb.1.gz)
install(FILES ${EMTB_MADE}/emtbd.8.gz ${EMTB_MADE}/emtb-safe.8.gz ${EMTB_MADE}/emtb-plant.8.gz DESTINATION share/man/man8)
install(FILES ${EMTB_MADE}/emtb.bash DESTINATION share/bash-completion/completions RENAME emtb)
install(FILES ${EMTB_MADE}/emtb.zsh DESTINATION share/zsh/vendor-completions RENAME _emtb)
install(FILES systemd/60-emtb.rules DESTINATION lib/udev/rules.d)
install(FILES systemd/emtb.sysusers.conf DESTINATION lib/sysusers.d RENAME emtb.conf)
install(FILES systemd/emtb.tmpfiles.conf DESTINATION lib/tmpfiles.d RENAME emtb.conf)
install(FILES packaging/debian/copyright NOTICE README.md CHANGELOG.md CONTRIBUTING.md DESTINATION share/doc/emtb)
install(DIRECTORY docs python octave DESTINATION share/doc/emtb FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ
        PATTERN "__pycache__" EXCLUDE PATTERN "*.egg-info" EXCLUDE PATTERN "build" EXCLUDE)
# What the pages call config/ is where they point.
install(CODE "file(CREATE_LINK ../../emtb \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/share/doc/emtb/config SYMBOLIC)")
# The unit names its programs where they are installed, by their whole path: systemd takes no other.
install(CODE "
  file(READ ${CMAKE_SOURCE_DIR}/systemd/emtbd.service unit)
  get_filename_component(prefix \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
  string(REPLACE /usr/bin/ \${prefix}/bin/ unit \"\${unit}\")
  file(WRITE ${EMTB_MADE}/emtbd.service \"\${unit}\")")
install(FILES ${EMTB_MADE}/emtbd.service DESTINATION lib/systemd/system)
install(FILES packaging/needrestart.conf DESTINATION /etc/needrestart/conf.d RENAME emtb.conf COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES packaging/debian/lintian-overrides DESTINATION share/lintian/overrides RENAME emtb COMPONENT debian EXCLUDE_FROM_ALL)
install(DIRECTORY DESTINATION /etc/emtb COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES ${EMTB_MADE}/changelog.gz DESTINATION share/doc/emtb COMPONENT debian EXCLUDE_FROM_ALL)

set(EMTB_MAINTAINER "The authors of emtb <emtb@localhost>" CACHE STRING "Whom the Debian package names: Name <address>")
file(WRITE ${EMTB_MADE}/changelog "emtb (${PROJECT_VERSION}) bookworm; urgency=medium

  * Built from commit ${EMTB_COMMIT}.
    What changed stands in CHANGELOG.md of the sources.

 -- ${EMTB_MAINTAINER}  Thu, 01 Jan 2026 00:00:00 +0000
")
execute_process(COMMAND gzip -9nc ${EMTB_MADE}/changelog OUTPUT_FILE ${EMTB_MADE}/changelog.gz)
file(WRITE ${EMTB_MADE}/conffiles "/etc/needrestart/conf.d/emtb.conf\n")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME emtb)
set(CPACK_PACKAGE_VENDOR "The authors of emtb")
set(CPACK_PACKAGE_CONTACT "${EMTB_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "DC-motor test bench, and what the model of the motor is missing")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
    "Runs a DC-motor test bench: a daemon that reads it, drives its reference,
records it and keeps it safe, and a command line that compares recordings
with a model of the motor, names the physical effect that the model lacks,
and watches the error fall on runs that no fit has seen.
.
Installing starts nothing: a bench file must be chosen first. An upgrade
never restarts the daemon.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL Unspecified debian)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "udev")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "octave, python3, python3-h5py, gcc")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${EMTB_MADE}/conffiles ${EMTB_PACKAGING}/debian/postinst
                                       ${EMTB_PACKAGING}/debian/prerm ${EMTB_PACKAGING}/debian/postrm)
include(CPack)
