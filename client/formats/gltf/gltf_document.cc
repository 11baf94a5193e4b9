#include "client/formats/gltf/gltf_document.h"

#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "client/formats/text_number.h"

namespace hulld {
namespace {

using google::protobuf::ListValue;
using google::protobuf::Struct;
using google::protobuf::Value;

// True for extensions that affect only the appearance of surfaces, and for the implemented
// extension.
bool IsKnownExtension(const std::string& name) {
  for (const char* prefix : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_",
                             "KHR_lights_punctual", "KHR_mesh_quantization"}) {
    if (name.rfind(prefix, 0) == 0) return true;
  }
  return false;
}

// Returns the text with a question mark instead of each byte that is not UTF-8. Some exporters
// write names in other encodings.
std::string ReplaceInvalidUtf8(std::string text) {
  for (size_t at = 0; at < text.size();) {
    const size_t length = Utf8Length(std::string_view(text).substr(at));
    if (length == 0) text[at] = '?';
    at += std::max<size_t>(length, 1);
  }
  return text;
}

}  // namespace

absl::Status GltfDocument::Load() {
  ReadContainer();
  if (ok()) CheckVersion();
  if (ok()) LoadBuffers();
  return status_;
}

void GltfDocument::Fail(const std::string& message) {
  Keep(absl::InvalidArgumentError(absl::StrCat(source_->name(), ": ", message)));
}

void GltfDocument::Keep(const absl::Status& status) {
  if (ok()) status_ = status;
}

const Value* GltfDocument::Find(const Struct& object, const std::string& key) {
  const auto found = object.fields().find(key);
  return found == object.fields().end() ? nullptr : &found->second;
}

const Struct& GltfDocument::ObjectOf(const Struct& object, const std::string& key) {
  const Value* const value = Find(object, key);
  if (value == nullptr) return Struct::default_instance();
  if (!value->has_struct_value()) Fail(absl::StrCat(key, " is not an object"));
  return value->struct_value();
}

const ListValue& GltfDocument::ListOf(const Struct& object, const std::string& key) {
  const Value* const value = Find(object, key);
  if (value == nullptr) return ListValue::default_instance();
  if (!value->has_list_value()) Fail(absl::StrCat(key, " is not an array"));
  return value->list_value();
}

std::string GltfDocument::TextOf(const Struct& object, const std::string& key) {
  const Value* const value = Find(object, key);
  if (value == nullptr) return {};
  if (!value->has_string_value()) Fail(absl::StrCat(key, " is not a string"));
  return value->string_value();
}

size_t GltfDocument::Integer(const Value& value, const std::string& what) {
  const double number = value.number_value();
  if (value.has_number_value() && number >= 0 && number < 0x1p53 && number == std::floor(number)) {
    return static_cast<size_t>(number);
  }
  Fail(absl::StrCat(what, " is not a whole number of at least 0"));
  return 0;
}

std::optional<size_t> GltfDocument::IntegerOf(const Struct& object, const std::string& key) {
  const Value* const value = Find(object, key);
  if (value == nullptr) return std::nullopt;
  return Integer(*value, key);
}

std::vector<double> GltfDocument::NumbersOf(const Struct& object, const std::string& key,
                                            int count) {
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

const Struct& GltfDocument::Element(const std::string& list, size_t index) {
  const auto& values = ListOf(root_, list).values();
  if (index >= static_cast<size_t>(values.size())) {
    Fail(absl::StrCat(list, "[", index, "] is out of range; the list's size is ", values.size()));
    return Struct::default_instance();
  }
  const Value& value = values[static_cast<int>(index)];
  if (!value.has_struct_value()) Fail(absl::StrCat(list, "[", index, "] is not an object"));
  return value.struct_value();
}

size_t GltfDocument::CountOf(const std::string& list) {
  return static_cast<size_t>(ListOf(root_, list).values_size());
}

void GltfDocument::ReadContainer() {
  std::string bytes = source_->ReadRest();
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
  const auto parsed =
      google::protobuf::util::JsonStringToMessage(ReplaceInvalidUtf8(std::move(json)), &root_);
  if (!parsed.ok()) {
    Fail(absl::StrCat("is not valid glTF JSON: ",
                      JsonProblem({parsed.message().data(), parsed.message().size()})));
  }
}

// Returns the JSON chunk, and stores the binary chunk.
std::string GltfDocument::SplitGlb(const std::string& bytes) {
  const auto load = [&bytes](size_t at) {
    uint32_t value = 0;
    if (at + sizeof(value) <= bytes.size()) std::memcpy(&value, &bytes[at], sizeof(value));
    return value;
  };
  constexpr uint32_t kJson = 0x4E4F534A;
  constexpr uint32_t kBinary = 0x004E4942;
  if (load(4) != 2) {
    Fail(
        absl::StrCat("byte 4: GLB version ", load(4), " is not supported; convert it to glTF 2.0"));
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

void GltfDocument::CheckVersion() {
  const std::string version = TextOf(ObjectOf(root_, "asset"), "version");
  if (version.rfind("2.", 0) != 0) {
    Fail(absl::StrCat("asset.version is ", Quoted(version),
                      "; only glTF 2.0 is supported; convert the file"));
  }
  for (const Value& extension : ListOf(root_, "extensionsRequired").values()) {
    if (!IsKnownExtension(extension.string_value())) RefuseExtension(extension.string_value());
  }
}

void GltfDocument::RefuseExtension(const std::string& name) {
  Fail(absl::StrCat("the extension ", Quoted(name),
                    " is required, but not supported; export the file without it"));
}

void GltfDocument::LoadBuffers() {
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

std::string GltfDocument::DataOf(const std::string& uri, const std::string& what) {
  const size_t comma = uri.find(',');
  if (comma == std::string::npos) {
    Fail(absl::StrCat(what, ": the data URI has no comma"));
    return {};
  }
  std::string bytes = PercentDecoded(uri.substr(comma + 1));
  std::string decoded;
  if (!absl::EndsWithIgnoreCase(uri.substr(0, comma), ";base64")) return bytes;
  if (!absl::Base64Unescape(bytes, &decoded)) {
    Fail(absl::StrCat(what, ": the data URI is not base64"));
  }
  return decoded;
}

std::string GltfDocument::FileOf(const std::string& uri, size_t size, const std::string& what) {
  std::string name = PercentDecoded(uri);
  const std::filesystem::path folder = std::filesystem::path(source_->name()).parent_path();
  std::error_code error;
  // Exporters on Windows may write its separator.
  if (!std::filesystem::exists(folder / name, error)) {
    std::replace(name.begin(), name.end(), '\\', '/');
  }
  const std::filesystem::path path = folder / name;
  const uintmax_t file_size = std::filesystem::file_size(path, error);
  if (uri.find("://") != std::string::npos || name.find('\0') != std::string::npos || error) {
    Fail(absl::StrCat(what, ": the file ", Quoted(name), " cannot be read",
                      error ? ": " + error.message() : "", "; put it next to the glTF file"));
    return {};
  }
  if (file_size < size) {
    Fail(absl::StrCat(what, " declares ", size, " bytes, but ", Quoted(name), " has ", file_size));
    return {};
  }
  auto file = ByteSource::Open(path.string());
  std::string bytes(size, '\0');
  if (!file.ok() || !(*file)->Read(bytes.data(), size)) {
    Fail(absl::StrCat(what, ": the file ", Quoted(name), " cannot be read"));
  }
  return bytes;
}

// Returns the elements of `object`, an accessor or a part of a sparse one, in its buffer view.
GltfDocument::View GltfDocument::ViewOf(const Struct& object, size_t count, size_t size,
                                        const std::string& what) {
  const Struct& view = Element("bufferViews", IntegerOf(object, "bufferView").value_or(0));
  const size_t buffer = IntegerOf(view, "buffer").value_or(std::numeric_limits<size_t>::max());
  const size_t view_offset = IntegerOf(view, "byteOffset").value_or(0);
  const size_t length = IntegerOf(view, "byteLength").value_or(0);
  const size_t offset = IntegerOf(object, "byteOffset").value_or(0);
  // Some exporters write 0 for the default.
  const size_t written_stride = IntegerOf(view, "byteStride").value_or(0);
  const size_t stride = written_stride == 0 ? size : written_stride;
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

std::optional<ScalarType> GltfDocument::TypeOf(const Struct& object, const std::string& what) {
  static constexpr std::pair<size_t, ScalarType> kTypes[] = {
      {5120, ScalarType::kInt8},   {5121, ScalarType::kUint8},  {5122, ScalarType::kInt16},
      {5123, ScalarType::kUint16}, {5125, ScalarType::kUint32}, {5126, ScalarType::kFloat}};
  const size_t type = IntegerOf(object, "componentType").value_or(0);
  for (const auto& [number, scalar] : kTypes) {
    if (number == type) return scalar;
  }
  Fail(absl::StrCat(what, " has an unknown componentType ", type));
  return std::nullopt;
}

std::vector<uint32_t> GltfDocument::Indices(const Struct& object, size_t count, size_t limit,
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

// Returns an element, integers unchanged, or divided by the largest one, as KHR_mesh_quantization
// defines it for positions.
template <size_t kSize>
std::array<double, kSize> GltfDocument::ElementAt(const unsigned char* bytes, ScalarType type,
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

template <size_t kSize>
GltfDocument::Elements<kSize> GltfDocument::ElementsOf(size_t index, bool* is_float) {
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
  // Some exporters write empty primitives.
  if (ok() && count == 0 && Find(accessor, "count") != nullptr) return elements;
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
    const View values = ViewOf(ObjectOf(sparse, "values"), changed, size, what + ".sparse.values");
    for (size_t i = 0; i < changed && ok(); ++i) {
      elements[indices[i]] = ElementAt<kSize>(values.at(i), *type, normalized);
    }
  }
  if (is_float != nullptr) *is_float = *type == ScalarType::kFloat;
  return elements;
}

template GltfDocument::Elements<3> GltfDocument::ElementsOf<3>(size_t, bool*);
template GltfDocument::Elements<4> GltfDocument::ElementsOf<4>(size_t, bool*);
template GltfDocument::Elements<16> GltfDocument::ElementsOf<16>(size_t, bool*);

}  // namespace hulld
