"""The encoding of google.rpc's error details, as protoc makes it from proto/hulld/rpc."""
