#include "client/hullctl/view/protocol.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "client/formats/text_number.h"
#include "client/hullctl/printing/json.h"
#include "client/packed_placements.h"
#include "client/pose/rigid_pose.h"

namespace hulld {
namespace {

using google::protobuf::ListValue;
using google::protobuf::Struct;
using google::protobuf::Value;

static_assert(std::endian::native == std::endian::little, "frames are little-endian");

// Reads members of a message, and keeps the first type error.
class Reader {
 public:
  explicit Reader(const Struct& object) : object_(object) {}

  std::string Text(const std::string& name) {
    const Value* const value = Find(name);
    if (value == nullptr) return "";
    if (value->kind_case() != Value::kStringValue) Complain(name, "is not a string");
    return value->string_value();
  }
  double Number(const std::string& name) {
    const Value* const value = Find(name);
    if (value == nullptr) return 0;
    if (value->kind_case() != Value::kNumberValue) Complain(name, "is not a number");
    return value->number_value();
  }
  bool Flag(const std::string& name) {
    const Value* const value = Find(name);
    return value != nullptr && value->bool_value();
  }
  const ListValue& List(const std::string& name) {
    const Value* const value = Find(name);
    return value == nullptr ? ListValue::default_instance() : value->list_value();
  }
  std::vector<uint32_t> Indices(const std::string& name) {
    std::vector<uint32_t> indices;
    for (const Value& value : List(name).values()) {
      const double number = value.number_value();
      if (!(number >= 0) || number > std::numeric_limits<uint32_t>::max() ||
          number != std::floor(number)) {
        Complain(name, "contains a value that is not an index");
        return {};
      }
      indices.push_back(static_cast<uint32_t>(number));
    }
    return indices;
  }
  // Reads an integer from 0 to 2^53.
  uint64_t Count(const std::string& name) {
    const double number = Number(name);
    if (number >= 0 && number <= 0x1p53 && number == std::floor(number)) {
      return static_cast<uint64_t>(number);
    }
    Complain(name, "is not a whole number");
    return 0;
  }

  void Complain(const std::string& name, const std::string& what) {
    if (status_.ok()) status_ = absl::InvalidArgumentError(absl::StrCat("\"", name, "\" ", what));
  }
  const absl::Status& status() const { return status_; }

 private:
  const Value* Find(const std::string& name) const {
    const auto member = object_.fields().find(name);
    return member == object_.fields().end() ? nullptr : &member->second;
  }

  const Struct& object_;
  absl::Status status_;
};

ViewQuery ReadQuery(Reader* reader) {
  ViewQuery query;
  query.scene = reader->Count("scene");
  query.update = reader->Count("update");
  query.objects = reader->Indices("objects");
  const ListValue& poses = reader->List("poses");
  if (poses.values_size() != static_cast<int>(7 * query.objects.size())) {
    reader->Complain("poses", "needs seven numbers for each entry of objects");
    return query;
  }
  query.poses.resize(query.objects.size());
  for (int i = 0; i < poses.values_size(); ++i) {
    query.poses[static_cast<size_t>(i) / 7][static_cast<size_t>(i) % 7] =
        poses.values(i).number_value();
  }
  const std::vector<uint32_t> pair = reader->Indices("pair");
  if (pair.size() == 2 && pair[0] != pair[1]) query.pair.emplace(pair[0], pair[1]);
  if (!pair.empty() && !query.pair) reader->Complain("pair", "does not name two objects");
  query.tolerance = reader->Number("tolerance");
  query.certificate = reader->Flag("certificate");
  query.rest = reader->Flag("rest");
  return query;
}

std::vector<ShapeRequest> ReadGeometry(Reader* reader) {
  std::vector<ShapeRequest> shapes;
  for (const uint32_t file : reader->Indices("files")) shapes.emplace_back().file = file;
  for (const Value& hull : reader->List("hullIds").values()) {
    shapes.emplace_back().hull_id = hull.string_value();
  }
  return shapes;
}

ShapeRequest ReadSimplification(Reader* reader) {
  ShapeRequest shape;
  v1::GetHullMeshRequest& request = shape.simplified.emplace();
  request.set_hull_id(reader->Text("hullId"));
  v1::Simplification* const simplification = request.mutable_simplification();
  simplification->set_side(reader->Text("side") == "outside" ? v1::SIMPLIFICATION_SIDE_OUTSIDE
                                                             : v1::SIMPLIFICATION_SIDE_INSIDE);
  simplification->set_max_error(reader->Number("maxError"));
  simplification->set_max_vertices(reader->Count("maxVertices"));
  return shape;
}

ViewConfiguration ReadConfiguration(Reader* reader) {
  ViewConfiguration configuration;
  configuration.scene = reader->Count("scene");
  for (const Value& number : reader->List("values").values()) {
    if (!std::isfinite(number.number_value()) || number.kind_case() != Value::kNumberValue) {
      reader->Complain("values", "contains a value that is not a finite number");
    }
    configuration.values.push_back(number.number_value());
  }
  return configuration;
}

template <typename Number>
void AppendBytes(const std::vector<Number>& numbers, std::string* frame) {
  frame->append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
}

// Returns the start of a frame.
std::string StartFrame(const std::string& head, size_t room) {
  const auto length = static_cast<uint32_t>(head.size());
  std::string frame;
  frame.reserve(sizeof(length) + head.size() + sizeof(double) + room);
  frame.append(reinterpret_cast<const char*>(&length), sizeof(length));
  frame += head;
  frame.resize((frame.size() + 7) / 8 * 8);
  return frame;
}

std::string FacetFrame(JsonObject head, const HullMesh& mesh) {
  head.AddJson("header", MessageJson(mesh.header))
      .AddJson("vertices", std::to_string(mesh.vertex_count()))
      .AddJson("facets", std::to_string(mesh.facet_sizes.size()))
      .AddJson("indices", std::to_string(mesh.facet_indices.size()));
  std::string frame =
      StartFrame(head.Close(),
                 8 * mesh.xyz.size() + 4 * (mesh.facet_sizes.size() + mesh.facet_indices.size()));
  AppendBytes(mesh.xyz, &frame);
  AppendBytes(mesh.facet_sizes, &frame);
  AppendBytes(mesh.facet_indices, &frame);
  return frame;
}

}  // namespace

absl::StatusOr<PageMessage> ParsePageMessage(std::string_view json) {
  Struct object;
  const absl::Status parsed = ParseJson(std::string(json), UnknownFields::kRefuse, &object);
  if (!parsed.ok()) return parsed;
  Reader reader(object);
  const std::string type = reader.Text("type");
  PageMessage message;
  if (type == "show") {
    message.show = reader.Text("key");
  } else if (type == "geometry") {
    message.geometry = ReadGeometry(&reader);
  } else if (type == "simplify") {
    message.geometry.push_back(ReadSimplification(&reader));
  } else if (type == "query") {
    message.query = ReadQuery(&reader);
  } else if (type == "joints") {
    message.joints = ReadConfiguration(&reader);
  } else {
    reader.Complain("type", "is unknown to the bridge");
  }
  if (!reader.status().ok()) return reader.status();
  return message;
}

std::string TextMessage(const std::string& type,
                        const std::vector<std::pair<std::string, std::string>>& members) {
  JsonObject message;
  message.Add("type", type);
  for (const auto& [name, json] : members) message.AddJson(name.c_str(), json);
  return message.Close();
}

std::string ProblemMessage(const std::string& message) {
  return TextMessage("problem", {{"message", QuoteJson(message)}});
}

std::string NumberJson(double number) {
  return std::isfinite(number) ? ShortestText(number) : "null";
}

std::string NumbersJson(std::span<const double> numbers) { return JsonArray(numbers, NumberJson); }

std::string ObjectsJson(const std::vector<ViewObject>& objects) {
  return JsonArray(objects, [](const ViewObject& object) {
    return JsonObject()
        .Add("name", object.name)
        .Add("hullId", object.hull_id)
        .AddJson("file", std::to_string(object.file))
        .AddJson("pose", NumbersJson(object.pose))
        .AddJson("radius", NumberJson(object.radius))
        .AddJson("isJointed", object.is_jointed ? "true" : "false")
        .AddJson("endPose", object.motion ? NumbersJson(object.motion->end) : "null")
        .Close();
  });
}

std::string PosesJson(const std::vector<RigidPose>& poses) {
  std::vector<double> numbers;
  for (const RigidPose& pose : poses) numbers.insert(numbers.end(), pose.begin(), pose.end());
  return NumbersJson(numbers);
}

std::string SceneMessage(const ViewScene& scene, uint64_t number) {
  const auto file_json = [](const auto& file) {
    return JsonObject().Add("name", file->name).Close();
  };
  const auto joint_json = [](const ViewJoints::Joint& joint) {
    return JsonObject()
        .Add("name", joint.name)
        .AddJson("low", NumberJson(joint.low))
        .AddJson("high", NumberJson(joint.high))
        .AddJson("value", NumberJson(joint.value))
        .Close();
  };
  const auto index_json = [](uint32_t index) { return std::to_string(index); };
  std::span<const uint32_t> named;
  if (scene.pairs) named = std::span(*scene.pairs).first(std::min<size_t>(scene.pairs->size(), 2));
  return TextMessage("scene", {{"number", std::to_string(number)},
                               {"key", QuoteJson(scene.key)},
                               {"title", QuoteJson(scene.title)},
                               {"note", QuoteJson(scene.note)},
                               {"files", JsonArray(scene.files, file_json)},
                               {"objects", ObjectsJson(scene.objects)},
                               {"joints", JsonArray(scene.joints.joints, joint_json)},
                               {"waypoints", JsonArray(scene.joints.waypoints, NumbersJson)},
                               {"contacts", JsonArray(scene.joints.contacts, index_json)},
                               {"named", JsonArray(named, index_json)},
                               {"watch", JsonArray(scene.watch)}});
}

std::string HullFrame(const std::string& hull_id, const HullMesh& mesh) {
  return FacetFrame(std::move(JsonObject().Add("kind", "hull").Add("hullId", hull_id)), mesh);
}

std::string BodyFrame(const v1::GetBodyResponse& body) {
  const auto piece_json = [](const v1::Placement& piece) {
    return JsonObject()
        .Add("hullId", piece.hull_id())
        .AddJson("pose", NumbersJson(NumbersOf(piece.pose())))
        .AddJson("radius", NumberJson(piece.radius()))
        .Close();
  };
  return StartFrame(JsonObject()
                        .Add("kind", "body")
                        .Add("hullId", body.body().body_id())
                        .AddJson("info", MessageJson(body.body()))
                        .AddJson("pieces", JsonArray(body.pieces(), piece_json))
                        .Close(),
                    0);
}

std::string SimplifiedFrame(const v1::GetHullMeshRequest& request, const HullMesh& mesh) {
  const bool outside = request.simplification().side() == v1::SIMPLIFICATION_SIDE_OUTSIDE;
  return FacetFrame(std::move(JsonObject()
                                  .Add("kind", "simplified")
                                  .Add("hullId", request.hull_id())
                                  .Add("side", outside ? "outside" : "inside")),
                    mesh);
}

std::string MeshFrame(uint32_t file, const FileShape& shape) {
  const std::string head = JsonObject()
                               .Add("kind", "mesh")
                               .AddJson("file", std::to_string(file))
                               .AddJson("vertices", std::to_string(shape.xyz.size() / 3))
                               .AddJson("triangles", std::to_string(shape.triangles.size() / 3))
                               .AddJson("points", std::to_string(shape.point_count))
                               .Close();
  std::string frame = StartFrame(head, 8 * shape.xyz.size() + 4 * shape.triangles.size());
  AppendBytes(shape.xyz, &frame);
  AppendBytes(shape.triangles, &frame);
  return frame;
}

std::string MissingFrame(const ShapeRequest& shape, const std::string& message) {
  JsonObject head;
  head.Add("kind", "missing");
  if (shape.file) head.AddJson("file", std::to_string(*shape.file));
  if (shape.hull_id) head.Add("hullId", *shape.hull_id);
  if (shape.simplified) head.Add("simplified", shape.simplified->hull_id());
  head.Add("message", message);
  return StartFrame(head.Close(), 0);
}

}  // namespace hulld
