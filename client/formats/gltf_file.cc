// glTF 2.0 (Khronos, 2017; ISO/IEC 12113:2022): JSON that describes nodes, meshes, and accessors
// into buffers, which lie in the JSON, beside it, or in one binary file (GLB) with it.
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "client/formats/binary_scalar.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

using google::protobuf::ListValue;
using google::protobuf::Struct;
using google::protobuf::Value;

// Row-major 3 x 4: rotation, scale and shear, then translation.
struct Affine {
  std::array<std::array<double, 4>, 3> m = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
};

Affine operator*(const Affine& a, const Affine& b) {
  Affine product;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? a.m[row][3] : 0;
      for (size_t k = 0; k < 3; ++k) sum += a.m[row][k] * b.m[k][column];
      product.m[row][column] = sum;
    }
  }
  return product;
}

std::array<double, 3> operator*(const Affine& a, const std::array<double, 3>& p) {
  std::array<double, 3> q;
  for (size_t row = 0; row < 3; ++row) {
    const auto& m = a.m[row];
    q[row] = m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3];
  }
  return q;
}

// A primitive of a mesh, placed by a node.
struct Primitive {
  std::string node;
  // The node's number, or that of the mesh if the file has no nodes.
  size_t number = 0;
  TriangleMesh mesh;
  // True if the vertices are floats of the file, not transformed.
  bool is_float = false;
};

using PrimitiveVisitor = std::function<absl::Status(const Primitive& primitive)>;

// True for extensions that affect only the appearance of surfaces, and for the implemented one.
bool IsKnownExtension(const std::string& name) {
  for (const char* prefix : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
                             "KHR_lights_punctual", "KHR_mesh_quantization"}) {
    if (name.rfind(prefix, 0) == 0) return true;
  }
  return false;
}

// After an error, every function returns immediately, and Run returns the error.
class GltfWalk {
 public:
  GltfWalk(ByteSource* source, const PrimitiveVisitor& visit) : source_(source), visit_(visit) {}

  absl::Status Run() {
    ReadContainer();
    if (ok()) CheckVersion();
    if (ok()) LoadBuffers();
    if (ok()) VisitScene();
    if (ok() && vertices_ == 0) Fail("the meshes of the scene have no vertex");
    return status_;
  }

 private:
  bool ok() const { return status_.ok(); }

  void Fail(const std::string& message) {
    if (ok()) status_ = absl::InvalidArgumentError(absl::StrCat(source_->name(), ": ", message));
  }

  // JSON ------------------------------------------------------------------------------------------

  static const Value* Find(const Struct& object, const std::string& key) {
    const auto found = object.fields().find(key);
    return found == object.fields().end() ? nullptr : &found->second;
  }

  // Returns the object under `key`; empty if it is missing.
  const Struct& ObjectOf(const Struct& object, const std::string& key) {
    const Value* const value = Find(object, key);
    if (value == nullptr) return Struct::default_instance();
    if (!value->has_struct_value()) Fail(absl::StrCat(key, " is not an object"));
    return value->struct_value();
  }

  const ListValue& ListOf(const Struct& object, const std::string& key) {
    const Value* const value = Find(object, key);
    if (value == nullptr) return ListValue::default_instance();
    if (!value->has_list_value()) Fail(absl::StrCat(key, " is not an array"));
    return value->list_value();
  }

  std::string TextOf(const Struct& object, const std::string& key) {
    const Value* const value = Find(object, key);
    if (value == nullptr) return {};
    if (!value->has_string_value()) Fail(absl::StrCat(key, " is not a string"));
    return value->string_value();
  }

  size_t Integer(const Value& value, const std::string& what) {
    const double number = value.number_value();
    if (value.has_number_value() && number >= 0 && number < 0x1p53 &&
        number == std::floor(number)) {
      return static_cast<size_t>(number);
    }
    Fail(absl::StrCat(what, " is not a whole number of at least 0"));
    return 0;
  }

  std::optional<size_t> IntegerOf(const Struct& object, const std::string& key) {
    const Value* const value = Find(object, key);
    if (value == nullptr) return std::nullopt;
    return Integer(*value, key);
  }

  // Returns the numbers under `key`; empty if it is missing.
  std::vector<double> NumbersOf(const Struct& object, const std::string& key, int count) {
    const ListValue& list = ListOf(object, key);
    std::vector<double> numbers;
    for (const Value& value : list.values()) {
      if (!value.has_number_value() || !std::isfinite(value.number_value())) break;
      numbers.push_back(value.number_value());
    }
    if (Find(object, key) != nullptr && numbers.size() != static_cast<size_t>(count)) {
      Fail(absl::StrCat(key, " is not an array of ", count, " finite numbers"));
      numbers.clear();
    }
    return numbers;
  }

  // Returns element `index` of a list at the root, such as "nodes".
  const Struct& Element(const std::string& list, size_t index) {
    const auto& values = ListOf(root_, list).values();
    if (index >= static_cast<size_t>(values.size())) {
      Fail(absl::StrCat(list, "[", index, "] is out of range; the list's size is ", values.size()));
      return Struct::default_instance();
    }
    const Value& value = values[static_cast<int>(index)];
    if (!value.has_struct_value()) Fail(absl::StrCat(list, "[", index, "] is not an object"));
    return value.struct_value();
  }

  size_t CountOf(const std::string& list) {
    return static_cast<size_t>(ListOf(root_, list).values_size());
  }

  // Container and buffers -------------------------------------------------------------------------

  void ReadContainer() {
    std::string bytes;
    char block[1 << 16];
    while (const size_t count = source_->Peek(sizeof(block)).size()) {
      (void)source_->Read(block, count);
      bytes.append(block, count);
    }
    if (!source_->status().ok()) {
      status_ = source_->status();
      return;
    }
    file_bytes_ = bytes.size();
    std::string json = bytes.substr(0, 4) == "glTF" ? SplitGlb(bytes) : std::move(bytes);
    if (json.substr(0, 3) == "\xEF\xBB\xBF") json.erase(0, 3);
    if (!ok()) return;
    // Some writers pad the chunk with zeros instead of spaces.
    while (!json.empty() && json.back() == '\0') json.pop_back();
    const auto parsed = google::protobuf::util::JsonStringToMessage(json, &root_);
    if (!parsed.ok()) {
      const std::string problem(parsed.message().data(), parsed.message().size());
      Fail(absl::StrCat("is not valid glTF JSON: ", problem));
    }
  }

  // Returns the JSON chunk, and keeps the binary one.
  std::string SplitGlb(const std::string& bytes) {
    const auto load = [&bytes](size_t at) {
      uint32_t value = 0;
      if (at + sizeof(value) <= bytes.size()) std::memcpy(&value, &bytes[at], sizeof(value));
      return value;
    };
    constexpr uint32_t kJson = 0x4E4F534A;
    constexpr uint32_t kBinary = 0x004E4942;
    if (load(4) != 2) {
      Fail(absl::StrCat("byte 4: GLB version ", load(4),
                        " is not supported; convert it to glTF 2.0"));
      return {};
    }
    const size_t length = load(8);
    if (length < 20 || length > bytes.size()) {
      Fail(absl::StrCat("byte 8: the header declares ", length, " bytes, but the file has ",
                        bytes.size(), "; is it complete?"));
      return {};
    }
    std::string json;
    for (size_t at = 12; at < length;) {
      const size_t size = load(at);
      const uint32_t type = load(at + 4);
      if (length - at < 8 || size > length - at - 8) {
        Fail(absl::StrCat("byte ", at, ": a chunk reaches beyond the end of the file"));
        return {};
      }
      if (at == 12 && type != kJson) Fail("byte 16: the first chunk is not JSON");
      if (at == 12) json = bytes.substr(at + 8, size);
      if (type == kBinary && !binary_) binary_ = bytes.substr(at + 8, size);
      at += 8 + size;
    }
    return json;
  }

  void CheckVersion() {
    const std::string version = TextOf(ObjectOf(root_, "asset"), "version");
    if (version.rfind("2.", 0) != 0) {
      Fail(absl::StrCat("asset.version is ", Quoted(version),
                        "; only glTF 2.0 is supported; convert the file"));
    }
    for (const Value& extension : ListOf(root_, "extensionsRequired").values()) {
      if (!IsKnownExtension(extension.string_value())) RefuseExtension(extension.string_value());
    }
  }

  void RefuseExtension(const std::string& name) {
    Fail(absl::StrCat("the extension ", Quoted(name),
                      " is required, but not supported; export the file without it"));
  }

  void LoadBuffers() {
    for (size_t i = 0; i < CountOf("buffers") && ok(); ++i) {
      const Struct& buffer = Element("buffers", i);
      const std::string what = absl::StrCat("buffers[", i, "]");
      const size_t size = IntegerOf(buffer, "byteLength").value_or(0);
      const std::string uri = TextOf(buffer, "uri");
      std::string bytes;
      if (uri.rfind("data:", 0) == 0) {
        bytes = DataOf(uri, what);
      } else if (!uri.empty()) {
        bytes = FileOf(uri, size, what);
      } else if (i == 0 && binary_) {
        bytes = std::move(*binary_);
      } else {
        // Absent in some compressed files; an error if a view needs it.
        buffers_.emplace_back();
        continue;
      }
      if (bytes.size() < size) {
        Fail(absl::StrCat(what, " declares ", size, " bytes, but has ", bytes.size()));
      }
      bytes.resize(std::min(bytes.size(), size));
      file_bytes_ += bytes.size();
      buffers_.push_back(std::move(bytes));
    }
  }

  std::string DataOf(const std::string& uri, const std::string& what) {
    const size_t comma = uri.find(',');
    if (comma == std::string::npos) {
      Fail(absl::StrCat(what, ": the data URI has no comma"));
      return {};
    }
    const std::string head = uri.substr(0, comma);
    std::string bytes = PercentDecoded(uri.substr(comma + 1));
    constexpr std::string_view kBase64 = ";base64";
    const bool base64 = head.size() >= kBase64.size() &&
                        head.compare(head.size() - kBase64.size(), kBase64.size(), kBase64) == 0;
    std::string decoded;
    if (!base64) return bytes;
    if (!absl::Base64Unescape(bytes, &decoded)) {
      Fail(absl::StrCat(what, ": the data URI is not base64"));
    }
    return decoded;
  }

  std::string FileOf(const std::string& uri, size_t size, const std::string& what) {
    const std::string name = PercentDecoded(uri);
    const std::filesystem::path path =
        std::filesystem::path(source_->name()).parent_path() / std::filesystem::path(name);
    std::error_code error;
    const uintmax_t file_size = std::filesystem::file_size(path, error);
    if (uri.find("://") != std::string::npos || name.find('\0') != std::string::npos || error) {
      Fail(absl::StrCat(what, ": the file ", Quoted(name), " cannot be read",
                        error ? ": " + error.message() : "", "; put it next to the glTF file"));
      return {};
    }
    if (file_size < size) {
      Fail(
          absl::StrCat(what, " declares ", size, " bytes, but ", Quoted(name), " has ", file_size));
      return {};
    }
    auto file = ByteSource::Open(path.string());
    std::string bytes(size, '\0');
    if (!file.ok() || !(*file)->Read(bytes.data(), size)) {
      Fail(absl::StrCat(what, ": the file ", Quoted(name), " cannot be read"));
    }
    return bytes;
  }

  // Accessors -------------------------------------------------------------------------------------

  // Elements of equal size at equal distances in a buffer; stride 0 repeats `data`.
  struct View {
    const unsigned char* data = nullptr;
    size_t stride = 0;
    const unsigned char* at(size_t i) const { return data + i * stride; }
  };

  // Returns the elements of `object`, an accessor or a part of a sparse one, in its buffer view.
  View ViewOf(const Struct& object, size_t count, size_t size, const std::string& what) {
    const Struct& view = Element("bufferViews", IntegerOf(object, "bufferView").value_or(0));
    const size_t buffer = IntegerOf(view, "buffer").value_or(std::numeric_limits<size_t>::max());
    const size_t view_offset = IntegerOf(view, "byteOffset").value_or(0);
    const size_t length = IntegerOf(view, "byteLength").value_or(0);
    const size_t offset = IntegerOf(object, "byteOffset").value_or(0);
    const size_t stride = IntegerOf(view, "byteStride").value_or(size);
    if (!ok()) return {};
    if (Find(ObjectOf(view, "extensions"), "EXT_meshopt_compression") != nullptr &&
        (buffer >= buffers_.size() || !buffers_[buffer])) {
      RefuseExtension("EXT_meshopt_compression");
      return {};
    }
    if (buffer >= buffers_.size() || !buffers_[buffer]) {
      Fail(absl::StrCat(what, " has no bytes: its buffer has no uri, or does not exist"));
      return {};
    }
    const std::string& bytes = *buffers_[buffer];
    const bool view_fits = view_offset <= bytes.size() && length <= bytes.size() - view_offset;
    const bool fits = offset <= length && size <= length - offset && stride >= size &&
                      (count - 1) <= (length - offset - size) / stride;
    if (!view_fits || !fits) {
      Fail(absl::StrCat(what, " reaches beyond its buffer; is the file complete?"));
      return {};
    }
    return {reinterpret_cast<const unsigned char*>(bytes.data()) + view_offset + offset, stride};
  }

  std::optional<ScalarType> TypeOf(const Struct& object, const std::string& what) {
    switch (const size_t type = IntegerOf(object, "componentType").value_or(0)) {
      case 5120:
        return ScalarType::kInt8;
      case 5121:
        return ScalarType::kUint8;
      case 5122:
        return ScalarType::kInt16;
      case 5123:
        return ScalarType::kUint16;
      case 5125:
        return ScalarType::kUint32;
      case 5126:
        return ScalarType::kFloat;
      default:
        Fail(absl::StrCat(what, " has an unknown componentType ", type));
        return std::nullopt;
    }
  }

  // Reads indices of vertices, each below `limit`.
  std::vector<uint32_t> Indices(const Struct& object, size_t count, size_t limit,
                                const std::string& what) {
    const auto type = TypeOf(object, what);
    if (ok() && *type != ScalarType::kUint8 && *type != ScalarType::kUint16 &&
        *type != ScalarType::kUint32) {
      Fail(absl::StrCat(what, " are not unsigned integers"));
    }
    std::vector<uint32_t> indices;
    if (!ok() || count == 0) return indices;
    const View view = ViewOf(object, count, SizeOf(*type), what);
    for (size_t i = 0; i < count && ok(); ++i) {
      const double index = LoadScalar(*type, view.at(i), false);
      if (index >= static_cast<double>(limit)) {
        Fail(absl::StrCat(what, ": index ", index, " is out of range of ", limit, " vertices"));
      }
      indices.push_back(static_cast<uint32_t>(index));
    }
    return indices;
  }

  template <size_t kSize>
  using Elements = std::vector<std::array<double, kSize>>;

  // Returns an element, integers unchanged, or divided by the largest one, as KHR_mesh_quantization
  // defines it for positions.
  template <size_t kSize>
  static std::array<double, kSize> ElementAt(const unsigned char* bytes, ScalarType type,
                                             bool normalized) {
    double largest = 1;
    if (normalized && type == ScalarType::kInt8) largest = 127;
    if (normalized && type == ScalarType::kUint8) largest = 255;
    if (normalized && type == ScalarType::kInt16) largest = 32767;
    if (normalized && type == ScalarType::kUint16) largest = 65535;
    std::array<double, kSize> element;
    for (size_t i = 0; i < kSize; ++i) {
      const double value = LoadScalar(type, bytes + i * SizeOf(type), false);
      element[i] = largest == 1 ? value : std::max(value / largest, -1.0);
    }
    return element;
  }

  // Returns the elements of an accessor of type VEC3, VEC4, or MAT4.
  template <size_t kSize>
  Elements<kSize> ElementsOf(size_t index, bool* is_float = nullptr) {
    const std::string what = absl::StrCat("accessors[", index, "]");
    const Struct& accessor = Element("accessors", index);
    const size_t count = IntegerOf(accessor, "count").value_or(0);
    const auto type = TypeOf(accessor, what);
    Elements<kSize> elements;
    if (!ok()) return elements;
    const std::string shape = kSize == 3 ? "VEC3" : kSize == 4 ? "VEC4" : "MAT4";
    if (TextOf(accessor, "type") != shape || *type == ScalarType::kUint32) {
      const char* const role = kSize == 3 ? "a position" : kSize == 4 ? "of joints" : "a transform";
      Fail(absl::StrCat(what, " is not ", role, ": it must be ", shape,
                        " of floats or of 8- or 16-bit integers"));
    }
    const bool has_view = Find(accessor, "bufferView") != nullptr;
    const bool has_sparse = Find(accessor, "sparse") != nullptr;
    if (count == 0 || (!has_view && (!has_sparse || count > file_bytes_))) {
      Fail(absl::StrCat(what, " has no ", kSize == 3 ? "positions" : "elements",
                        ": neither a count nor a bufferView"));
    }
    const Value* const normalized_value = Find(accessor, "normalized");
    const bool normalized = normalized_value != nullptr && normalized_value->bool_value();
    const size_t size = kSize * SizeOf(*type);
    if (!ok()) return elements;
    if (has_view) {
      const View view = ViewOf(accessor, count, size, what);
      for (size_t i = 0; i < count && ok(); ++i) {
        elements.push_back(ElementAt<kSize>(view.at(i), *type, normalized));
      }
    } else {
      elements.resize(count);
    }
    if (has_sparse) {
      const Struct& sparse = ObjectOf(accessor, "sparse");
      const size_t changed = IntegerOf(sparse, "count").value_or(0);
      const std::vector<uint32_t> indices =
          Indices(ObjectOf(sparse, "indices"), changed, count, what + ".sparse.indices");
      if (!ok() || changed == 0) return elements;
      const View values =
          ViewOf(ObjectOf(sparse, "values"), changed, size, what + ".sparse.values");
      for (size_t i = 0; i < changed && ok(); ++i) {
        elements[indices[i]] = ElementAt<kSize>(values.at(i), *type, normalized);
      }
    }
    if (is_float != nullptr) *is_float = *type == ScalarType::kFloat;
    return elements;
  }

  // Meshes ----------------------------------------------------------------------------------------

  static std::vector<std::array<uint32_t, 3>> Triangles(const std::vector<uint32_t>& corners,
                                                        size_t mode) {
    constexpr size_t kTriangles = 4;
    constexpr size_t kStrip = 5;
    constexpr size_t kFan = 6;
    std::vector<std::array<uint32_t, 3>> triangles;
    if (mode < kTriangles) return triangles;
    for (size_t i = 2; i < corners.size(); i += mode == kTriangles ? 3 : 1) {
      const size_t odd = mode == kStrip && i % 2 != 0 ? 1 : 0;
      triangles.push_back(
          {corners[mode == kFan ? 0 : i - 2 + odd], corners[i - 1 - odd], corners[i]});
    }
    return triangles;
  }

  // Adds the displacements of morph targets, each times its weight.
  void Morph(const Struct& object, const std::vector<double>& weights, Primitive* primitive) {
    const auto& targets = ListOf(object, "targets").values();
    const size_t count = std::min(weights.size(), static_cast<size_t>(targets.size()));
    for (size_t target = 0; target < count && ok(); ++target) {
      const Value* const position =
          Find(targets[static_cast<int>(target)].struct_value(), "POSITION");
      if (weights[target] == 0 || position == nullptr) continue;
      const auto shifts = ElementsOf<3>(Integer(*position, "POSITION"));
      auto& vertices = primitive->mesh.vertices;
      if (ok() && shifts.size() != vertices.size()) {
        Fail(absl::StrCat("a morph target has ", Counted(shifts.size(), "position"), " for ",
                          Counted(vertices.size(), "vertex", "vertices")));
      }
      for (size_t i = 0; i < vertices.size() && ok(); ++i) {
        for (size_t axis = 0; axis < 3; ++axis) {
          vertices[i][axis] += weights[target] * shifts[i][axis];
        }
      }
      primitive->is_float = false;
    }
  }

  // Moves each vertex by the weighted mean of its joints' transforms, as they stand in the file.
  // Returns false if the primitive has no joints.
  bool Bend(const Struct& attributes, const std::vector<Affine>& joints, Primitive* primitive) {
    auto& vertices = primitive->mesh.vertices;
    std::vector<std::array<double, 3>> sums(vertices.size());
    std::vector<double> totals(vertices.size());
    for (size_t set = 0; ok(); ++set) {
      const Value* const joint = Find(attributes, absl::StrCat("JOINTS_", set));
      const Value* const weight = Find(attributes, absl::StrCat("WEIGHTS_", set));
      if (set == 0 && joint == nullptr) return false;
      if (joint == nullptr || weight == nullptr) break;
      const auto indices = ElementsOf<4>(Integer(*joint, "JOINTS"));
      const auto weights = ElementsOf<4>(Integer(*weight, "WEIGHTS"));
      if (ok() && (indices.size() != vertices.size() || weights.size() != vertices.size())) {
        Fail("a primitive has more or fewer joints than vertices");
      }
      for (size_t i = 0; i < vertices.size() && ok(); ++i) {
        for (size_t k = 0; k < 4; ++k) {
          if (weights[i][k] == 0) continue;
          if (!(indices[i][k] >= 0 && indices[i][k] < static_cast<double>(joints.size()))) {
            Fail(absl::StrCat("vertex ", i, " has the joint ", indices[i][k], ", but the skin has ",
                              joints.size()));
            break;
          }
          const auto moved = joints[static_cast<size_t>(indices[i][k])] * vertices[i];
          for (size_t axis = 0; axis < 3; ++axis) sums[i][axis] += weights[i][k] * moved[axis];
          totals[i] += weights[i][k];
        }
      }
    }
    for (size_t i = 0; i < vertices.size() && ok(); ++i) {
      if (totals[i] == 0) Fail(absl::StrCat("vertex ", i, " has no weight of a joint"));
      // Rounding makes the sum of the weights inexact.
      for (size_t axis = 0; axis < 3; ++axis) vertices[i][axis] = sums[i][axis] / totals[i];
    }
    primitive->is_float = false;
    return true;
  }

  // Returns the transform of each joint of a skin, from the mesh to the scene.
  std::vector<Affine> JointsOf(size_t index) {
    const Struct& skin = Element("skins", index);
    std::vector<Affine> joints;
    for (const Value& joint : ListOf(skin, "joints").values()) {
      const size_t node = Integer(joint, "joints");
      if (!ok()) return {};
      if (node >= X_WN_.size() || !X_WN_[node].has_value()) {
        Fail(absl::StrCat("skins[", index, "]: the joint nodes[", node, "] is not in the scene"));
        return {};
      }
      joints.push_back(*X_WN_[node]);
    }
    const auto inverse = IntegerOf(skin, "inverseBindMatrices");
    if (!ok() || !inverse) return joints;
    const auto matrices = ElementsOf<16>(*inverse);
    if (ok() && matrices.size() < joints.size()) {
      Fail(absl::StrCat("skins[", index, "] has fewer inverseBindMatrices than joints"));
    }
    for (size_t i = 0; i < joints.size() && ok(); ++i) {
      joints[i] = joints[i] * FromColumns({matrices[i].begin(), matrices[i].end()});
    }
    return joints;
  }

  void VisitPrimitive(const Struct& object, const Affine* X_WN, const Struct& node,
                      const std::vector<double>& weights, Primitive* primitive) {
    const Struct& attributes = ObjectOf(object, "attributes");
    const Value* const position = Find(attributes, "POSITION");
    if (!ok() || position == nullptr) return;
    if (Find(ObjectOf(object, "extensions"), "KHR_draco_mesh_compression") != nullptr &&
        Find(Element("accessors", Integer(*position, "POSITION")), "bufferView") == nullptr) {
      return RefuseExtension("KHR_draco_mesh_compression");
    }
    const size_t mode = IntegerOf(object, "mode").value_or(4);
    if (mode > 6) return Fail(absl::StrCat("a primitive has an unknown mode ", mode));
    std::vector<std::array<double, 3>>& vertices = primitive->mesh.vertices;
    vertices = ElementsOf<3>(Integer(*position, "POSITION"), &primitive->is_float);
    std::vector<uint32_t> corners;
    if (const auto index = IntegerOf(object, "indices"); ok() && index) {
      const Struct& accessor = Element("accessors", *index);
      const size_t count = IntegerOf(accessor, "count").value_or(0);
      corners = Indices(accessor, count, vertices.size(), absl::StrCat("accessors[", *index, "]"));
    } else if (mode >= 4) {
      for (uint32_t i = 0; i < vertices.size(); ++i) corners.push_back(i);
    }
    if (mode == 4 && Find(object, "indices") != nullptr && corners.size() % 3 != 0) {
      Fail(absl::StrCat("a primitive has ", corners.size(),
                        " corners, not three for each triangle"));
    }
    if (!ok()) return;
    primitive->mesh.triangles = Triangles(corners, mode);
    vertices_ += vertices.size();
    Morph(object, weights, primitive);
    const auto skin = IntegerOf(node, "skin");
    // The joints alone place a mesh with a skin.
    if (ok() && skin && Bend(attributes, JointsOf(*skin), primitive)) {
      if (ok()) status_ = visit_(*primitive);
      return;
    }
    if (!ok()) return;
    if (X_WN != nullptr) {
      for (auto& vertex : vertices) vertex = *X_WN * vertex;
      primitive->is_float = false;
    }
    status_ = visit_(*primitive);
  }

  // X_WN: null for the identity. node: empty if the file has none.
  void VisitMesh(size_t index, const Affine* X_WN, const Struct& node, Primitive primitive) {
    const Struct& mesh = Element("meshes", index);
    const Struct& weighted = Find(node, "weights") != nullptr ? node : mesh;
    const std::vector<double> weights =
        NumbersOf(weighted, "weights", ListOf(weighted, "weights").values_size());
    for (const Value& value : ListOf(mesh, "primitives").values()) {
      if (!value.has_struct_value()) Fail("a primitive is not an object");
      if (!ok()) return;
      VisitPrimitive(value.struct_value(), X_WN, node, weights, &primitive);
    }
  }

  Affine FromColumns(const std::vector<double>& columns) {
    if (columns[3] != 0 || columns[7] != 0 || columns[11] != 0 || columns[15] != 1) {
      Fail("the last row of a matrix is not 0 0 0 1");
    }
    Affine X;
    for (size_t i = 0; i < 12; ++i) X.m[i % 3][i / 3] = columns[i / 3 * 4 + i % 3];
    return X;
  }

  // Returns nullopt if the node has no transform.
  std::optional<Affine> TransformOf(const Struct& node) {
    const std::vector<double> columns = NumbersOf(node, "matrix", 16);
    const std::vector<double> t = NumbersOf(node, "translation", 3);
    const std::vector<double> q = NumbersOf(node, "rotation", 4);
    const std::vector<double> s = NumbersOf(node, "scale", 3);
    Affine X;
    if (!columns.empty()) {
      X = FromColumns(columns);
    } else {
      if (!q.empty()) {
        const double x = q[0], y = q[1], z = q[2], w = q[3];
        X.m = {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 0},
                {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 0},
                {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), 0}}};
      }
      for (size_t row = 0; row < 3; ++row) {
        for (size_t column = 0; column < 3 && !s.empty(); ++column) X.m[row][column] *= s[column];
        if (!t.empty()) X.m[row][3] = t[row];
      }
    }
    if (X.m == Affine().m) return std::nullopt;
    return X;
  }

  // Depth first, in the order of the file. A node has at most one parent.
  void VisitNodes(const std::vector<size_t>& roots) {
    X_WN_.resize(CountOf("nodes"));
    std::vector<bool> is_moved(CountOf("nodes"));
    std::vector<size_t> order;
    std::vector<std::pair<size_t, std::optional<Affine>>> pending;
    for (size_t i = roots.size(); i > 0; --i) pending.emplace_back(roots[i - 1], std::nullopt);
    while (!pending.empty() && ok()) {
      const auto [index, X_WP] = pending.back();
      pending.pop_back();
      const Struct& node = Element("nodes", index);
      if (!ok()) return;
      if (X_WN_[index]) return Fail(absl::StrCat("nodes[", index, "] has several parents"));
      if (Find(ObjectOf(node, "extensions"), "EXT_mesh_gpu_instancing") != nullptr) {
        return RefuseExtension("EXT_mesh_gpu_instancing");
      }
      std::optional<Affine> X_WN = TransformOf(node);
      if (X_WP) X_WN = X_WN ? *X_WP * *X_WN : *X_WP;
      X_WN_[index] = X_WN.value_or(Affine());
      is_moved[index] = X_WN.has_value();
      order.push_back(index);
      const auto& children = ListOf(node, "children").values();
      for (int i = children.size(); i > 0; --i) {
        pending.emplace_back(Integer(children[i - 1], "children"), X_WN);
      }
    }
    for (const size_t index : order) {
      if (!ok()) return;
      const Struct& node = Element("nodes", index);
      std::string name = TextOf(node, "name");
      if (name.empty()) name = absl::StrCat("nodes[", index, "]");
      if (const auto mesh = IntegerOf(node, "mesh"); ok() && mesh) {
        VisitMesh(*mesh, is_moved[index] ? &*X_WN_[index] : nullptr, node,
                  {name, index, {}, false});
      }
    }
  }

  void VisitScene() {
    std::vector<size_t> roots;
    if (CountOf("scenes") > 0) {
      const Struct& scene = Element("scenes", IntegerOf(root_, "scene").value_or(0));
      for (const Value& node : ListOf(scene, "nodes").values()) {
        roots.push_back(Integer(node, "nodes"));
      }
      return VisitNodes(roots);
    }
    std::vector<bool> is_child(CountOf("nodes"));
    for (size_t i = 0; i < is_child.size() && ok(); ++i) {
      for (const Value& child : ListOf(Element("nodes", i), "children").values()) {
        const size_t index = Integer(child, "children");
        if (index < is_child.size()) is_child[index] = true;
      }
    }
    for (size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) roots.push_back(i);
    }
    if (!is_child.empty() && roots.empty())
      return Fail("no node is a root: each one is the child of another");
    if (!roots.empty()) return VisitNodes(roots);
    for (size_t i = 0; i < CountOf("meshes") && ok(); ++i) {
      std::string name = TextOf(Element("meshes", i), "name");
      if (name.empty()) name = absl::StrCat("meshes[", i, "]");
      VisitMesh(i, nullptr, Struct::default_instance(), {name, i, {}, false});
    }
  }

  ByteSource* source_;
  const PrimitiveVisitor& visit_;
  absl::Status status_;
  Struct root_;
  std::optional<std::string> binary_;
  std::vector<std::optional<std::string>> buffers_;
  // Transforms of the scene's nodes.
  std::vector<std::optional<Affine>> X_WN_;
  size_t file_bytes_ = 0;
  size_t vertices_ = 0;
};

}  // namespace

absl::Status ReadGltf(ByteSource* source, PointCollector* points) {
  return GltfWalk(source,
                  [&](const Primitive& primitive) {
                    const auto& vertices = primitive.mesh.vertices;
                    for (size_t i = 0; i < vertices.size(); ++i) {
                      const auto error_at = [&](const std::string& message) {
                        return absl::InvalidArgumentError(
                            absl::StrCat(source->name(), ": vertex ", i, " of ",
                                         Quoted(primitive.node), ": ", message));
                      };
                      const auto& [x, y, z] = vertices[i];
                      absl::Status status =
                          primitive.is_float
                              ? points->AddFloat(static_cast<float>(x), static_cast<float>(y),
                                                 static_cast<float>(z), error_at)
                              : points->Add(x, y, z, error_at);
                      if (!status.ok()) return status;
                    }
                    return absl::OkStatus();
                  })
      .Run();
}

absl::Status ReadGltfParts(ByteSource* source, std::vector<MeshPart>* parts) {
  std::optional<size_t> last;
  return GltfWalk(
             source,
             [&](const Primitive& primitive) {
               for (const auto& [x, y, z] : primitive.mesh.vertices) {
                 if (std::isfinite(x) && std::isfinite(y) && std::isfinite(z)) continue;
                 return absl::InvalidArgumentError(absl::StrCat(
                     source->name(), ": a vertex of ", Quoted(primitive.node), " is not finite"));
               }
               if (last != primitive.number) parts->push_back({primitive.node, {}});
               last = primitive.number;
               return AddMesh(source->name(), primitive.mesh, &parts->back().mesh);
             })
      .Run();
}

}  // namespace hulld
