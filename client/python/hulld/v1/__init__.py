"""The contract's messages and gRPC's stubs for it, as protoc makes them from proto/hulld/v1.

`hulld.Client` needs none of them from its callers. They are here for what it does not wrap:
`hulld.v1.hull_pb2` holds the messages, and `hulld.v1.hull_pb2_grpc.HullServiceStub(client.channel)`
calls the service.
"""
