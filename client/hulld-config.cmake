# find_package(hulld): the targets hulld::client (headers such as "client/client.h"), hulld::verify (certificates checked by
# exact arithmetic) and hulld::proto (the contract's generated code).
include(CMakeFindDependencyMacro)
find_dependency(Threads)
find_dependency(absl)
find_dependency(Boost)
find_dependency(Protobuf)
find_dependency(gRPC CONFIG)
find_dependency(ZLIB)
include(${CMAKE_CURRENT_LIST_DIR}/hulld-targets.cmake)
