# The Debian packages: hulld, hullctl, libhulld-dev, and python3-hulld. docker/debian/build.sh builds them.

# A plain `cmake --install` omits files that only a package contains.
install(FILES docker/hulld.service DESTINATION /lib/systemd/system COMPONENT server EXCLUDE_FROM_ALL)
install(FILES docker/debian/hulld/hulld.toml DESTINATION /etc/hulld COMPONENT server EXCLUDE_FROM_ALL)
# --help documents every flag; the manual page and the completion are generated from it.
install(FILES docker/debian/hulld/hulld.completion DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME hulld COMPONENT server EXCLUDE_FROM_ALL)
install(CODE [[
  set(manual "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/share/man/man8")
  file(MAKE_DIRECTORY "${manual}")
  execute_process(COMMAND help2man --no-info --section=8 --name "serve convex hulls and exact collision queries"
                          --output=${manual}/hulld.8 "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/bin/hulld"
                  COMMAND_ERROR_IS_FATAL ANY)
]] COMPONENT server EXCLUDE_FROM_ALL)
install(CODE "set(source ${PROJECT_SOURCE_DIR}/client/python)" COMPONENT python EXCLUDE_FROM_ALL)
install(CODE [[
  execute_process(COMMAND env DEB_PYTHON_INSTALL_LAYOUT=deb /usr/bin/python3 -m pip install --quiet --no-deps
                          --no-build-isolation --no-compile --root-user-action=ignore --break-system-packages
                          --ignore-installed --root $ENV{DESTDIR} --prefix ${CMAKE_INSTALL_PREFIX} ${source}
                  COMMAND_ERROR_IS_FATAL ANY)
  # pip records the source folder in this file.
  file(GLOB direct_url $ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/lib/python3/dist-packages/hulld-*/direct_url.json)
  file(REMOVE ${direct_url})
]] COMPONENT python EXCLUDE_FROM_ALL)

foreach(package server:hulld hullctl:hullctl devel:libhulld-dev python:python3-hulld)
  string(REGEX MATCH "(.*):(.*)" package ${package})
  install(FILES docker/debian/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CMAKE_MATCH_2}
          COMPONENT ${CMAKE_MATCH_1} EXCLUDE_FROM_ALL)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL server hullctl devel python)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGE_CONTACT "The hulld authors <hulld@localhost>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd)

# CPack indents the descriptions.
set(CPACK_DEBIAN_SERVER_PACKAGE_NAME hulld)
set(CPACK_DEBIAN_SERVER_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SERVER_DESCRIPTION "server for convex hulls and exact collision queries
Keeps 3D convex hulls registered by ID, builds them as points stream in, and
answers separating-axis collision queries over gRPC, exactly on request.")
set(CPACK_DEBIAN_SERVER_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS "hullctl, postgresql, haproxy")
set(maintainer_scripts ${PROJECT_SOURCE_DIR}/docker/debian/hulld)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
    ${maintainer_scripts}/conffiles ${maintainer_scripts}/postinst ${maintainer_scripts}/prerm ${maintainer_scripts}/postrm)

set(CPACK_DEBIAN_HULLCTL_PACKAGE_NAME hullctl)
set(CPACK_DEBIAN_HULLCTL_PACKAGE_SECTION science)
set(CPACK_DEBIAN_HULLCTL_DESCRIPTION "command line of hulld
Reads points, meshes, scenes, and robots, asks a hulld server about collisions,
verifies the certificates of its answers, and shows scenes in a browser.")
set(CPACK_DEBIAN_HULLCTL_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_HULLCTL_PACKAGE_SUGGESTS hulld)

set(CPACK_DEBIAN_DEVEL_PACKAGE_NAME libhulld-dev)
set(CPACK_DEBIAN_DEVEL_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVEL_DESCRIPTION "C++ libraries of hulld
hulld::core computes hulls and collision queries in process; hulld::client talks
to a server; hulld::verify checks the certificates of its answers.")
set(CPACK_DEBIAN_DEVEL_PACKAGE_DEPENDS
    "libabsl-dev, libboost-dev, libeigen3-dev, libgrpc++-dev, libprotobuf-dev, pkg-config, protobuf-compiler-grpc, zlib1g-dev")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-hulld)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "Python client of hulld
Registers hulls from NumPy arrays, asks a hulld server about collisions, and
verifies the certificates of its answers.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), python3-grpcio, python3-numpy, python3-protobuf")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS hulld)
set(maintainer_scripts ${PROJECT_SOURCE_DIR}/docker/debian/python3-hulld)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${maintainer_scripts}/postinst ${maintainer_scripts}/prerm)
include(CPack)
