#ifndef HULLD_CLIENT_FORMATS_GLTF_GLTF_DOCUMENT_H_
#define HULLD_CLIENT_FORMATS_GLTF_GLTF_DOCUMENT_H_

#include <absl/status/status.h>
#include <google/protobuf/struct.pb.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/formats/binary_scalar.h"
#include "client/formats/byte_source.h"

namespace hulld {

// A glTF 2.0 document (Khronos, 2017; ISO/IEC 12113:2022): JSON that describes nodes, meshes, and
// accessors into buffers. Buffers are embedded in the JSON, in separate files, or in one binary
// file (GLB) with the JSON.
//
// Keeps the first error; after it, results are empty or zero, and callers return.
class GltfDocument {
 public:
  // source: must outlive this.
  explicit GltfDocument(ByteSource* source) : source_(source) {}

  // Reads the file and its buffers. INVALID_ARGUMENT: it is malformed or incomplete, or requires an
  // extension that is not supported.
  absl::Status Load();

  const absl::Status& status() const { return status_; }
  bool ok() const { return status_.ok(); }
  // Record an error unless an earlier one exists.
  void Fail(const std::string& message);
  void Keep(const absl::Status& status);
  void RefuseExtension(const std::string& name);

  // Returns a member of a JSON object, or null if it is missing.
  static const google::protobuf::Value* Find(const google::protobuf::Struct& object,
                                             const std::string& key);
  // Return a member, empty if it is missing. A member of another type is an error.
  const google::protobuf::Struct& ObjectOf(const google::protobuf::Struct& object,
                                           const std::string& key);
  const google::protobuf::ListValue& ListOf(const google::protobuf::Struct& object,
                                            const std::string& key);
  std::string TextOf(const google::protobuf::Struct& object, const std::string& key);
  std::optional<size_t> IntegerOf(const google::protobuf::Struct& object, const std::string& key);
  std::vector<double> NumbersOf(const google::protobuf::Struct& object, const std::string& key,
                                int count);
  // what: names the value in the error.
  size_t Integer(const google::protobuf::Value& value, const std::string& what);

  const google::protobuf::Struct& root() const { return root_; }
  // Returns element `index` of a list at the root, such as "nodes".
  const google::protobuf::Struct& Element(const std::string& list, size_t index);
  size_t CountOf(const std::string& list);

  template <size_t kSize>
  using Elements = std::vector<std::array<double, kSize>>;
  // Returns the elements of an accessor of type VEC3, VEC4, or MAT4. is_float, if not null: set to
  // true if they are floats of the file.
  template <size_t kSize>
  Elements<kSize> ElementsOf(size_t index, bool* is_float = nullptr);
  // Reads indices of vertices, each below `limit`, from an accessor or a part of a sparse one.
  std::vector<uint32_t> Indices(const google::protobuf::Struct& object, size_t count, size_t limit,
                                const std::string& what);

 private:
  // Elements of equal size at equal distances in a buffer; stride 0 repeats `data`.
  struct View {
    const unsigned char* data = nullptr;
    size_t stride = 0;
    const unsigned char* at(size_t i) const { return data + i * stride; }
  };

  void ReadContainer();
  std::string SplitGlb(const std::string& bytes);
  void CheckVersion();
  void LoadBuffers();
  std::string DataOf(const std::string& uri, const std::string& what);
  std::string FileOf(const std::string& uri, size_t size, const std::string& what);
  View ViewOf(const google::protobuf::Struct& object, size_t count, size_t size,
              const std::string& what);
  std::optional<ScalarType> TypeOf(const google::protobuf::Struct& object, const std::string& what);
  template <size_t kSize>
  static std::array<double, kSize> ElementAt(const unsigned char* bytes, ScalarType type,
                                             bool normalized);

  ByteSource* source_;
  absl::Status status_;
  google::protobuf::Struct root_;
  // The binary chunk of a GLB file.
  std::optional<std::string> binary_;
  std::vector<std::optional<std::string>> buffers_;
  size_t file_bytes_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_GLTF_GLTF_DOCUMENT_H_
