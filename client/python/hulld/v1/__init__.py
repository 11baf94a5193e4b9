"""The contract's messages and gRPC's stubs for it, as protoc makes them from proto/hulld/v1.

`hulld.Client` hides them from its callers. For calls that it does not wrap: `hulld.v1.hull_pb2`
holds the messages, and `hulld.v1.hull_pb2_grpc.HullServiceStub(client.channel)` calls the service.
"""
