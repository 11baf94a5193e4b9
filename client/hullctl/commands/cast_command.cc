#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/answer_row.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

using Triple = std::array<double, 3>;

struct CastArguments {
  Triple origin = {};
  Triple direction = {};
  std::string prefix;
};

// A hull that the ray hits.
struct Hit {
  std::string hull_id;
  double time = 0;
  Triple point = {};
  // Unit length, out of the hull; absent if the ray starts in contact.
  std::optional<Triple> normal;
};

// The integer's leading digits, without the last `dropped` ones.
double Leading(const std::string& digits, size_t dropped) {
  return digits.size() <= dropped
             ? 0
             : std::strtod(digits.substr(0, digits.size() - dropped).c_str(), nullptr);
}

Triple DirectionOf(const v1::SeparatedInterval& interval) {
  if (!interval.has_integer_direction()) {
    const v1::Vector3& n =
        interval.has_end_direction() ? interval.end_direction() : interval.direction();
    return {n.x(), n.y(), n.z()};
  }
  // The range of a double is 308 digits.
  constexpr size_t kMaxDigits = 300;
  const v1::IntegerDirection& n = interval.integer_direction();
  const size_t longest = std::max({n.x().size(), n.y().size(), n.z().size()});
  const size_t dropped = longest > kMaxDigits ? longest - kMaxDigits : 0;
  return {Leading(n.x(), dropped), Leading(n.y(), dropped), Leading(n.z(), dropped)};
}

// The plane that separates the ray from the hull until they meet is that of the facet, except
// within rounding of an edge or vertex.
std::optional<Triple> NormalOf(const v1::FirstContact& contact) {
  if (contact.intervals().empty()) return std::nullopt;
  Triple n = DirectionOf(*contact.intervals().rbegin());
  const double largest = std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])});
  for (double& x : n) x /= largest;
  const double length = std::hypot(n[0], n[1], n[2]);
  // From the ray to the hull. Adding 0 makes -0 positive.
  for (double& x : n) x = -x / length + 0.0;
  return n;
}

// A ray is a point that moves from its origin to its end.
class Ray {
 public:
  explicit Ray(const CastArguments& arguments) : origin_(arguments.origin) {
    for (int i = 0; i < 3; ++i) end_[i] = origin_[i] + arguments.direction[i];
  }

  bool HasFiniteEnd() const {
    return std::ranges::all_of(end_, [](double number) { return std::isfinite(number); });
  }

  Triple PointAt(double time) const {
    Triple point;
    for (int i = 0; i < 3; ++i) point[i] = std::lerp(origin_[i], end_[i], time);
    return point;
  }

  // A scene with the ray first, then these hulls.
  v1::FindCollisionsRequest RequestFor(const v1::ListHullsResponse& list) const {
    v1::FindCollisionsRequest request;
    request.mutable_wanted()->set_certificate(true);
    request.set_movers(1);
    v1::PackedPlacements& packed = *request.mutable_packed_placements();
    packed.add_shape_sizes(1);
    packed.mutable_shape_points()->mutable_xyz()->Resize(3, 0);
    Add(static_cast<uint32_t>(list.hulls_size()), origin_, end_, &packed);
    for (int i = 0; i < list.hulls_size(); ++i) {
      packed.add_hull_ids(list.hulls(i).hull_id());
      Add(static_cast<uint32_t>(i), {}, {}, &packed);
    }
    return request;
  }

 private:
  static void Add(uint32_t hull, const Triple& start, const Triple& end,
                  v1::PackedPlacements* packed) {
    packed->add_hulls(hull);
    for (const auto& [translation, poses] : {std::pair(&start, packed->mutable_poses()),
                                             std::pair(&end, packed->mutable_end_poses())}) {
      for (const double number : {1.0, 0.0, 0.0, 0.0}) poses->Add(number);
      poses->Add(translation->begin(), translation->end());
    }
  }

  Triple origin_;
  Triple end_ = {};
};

// Hits in ascending order of time, and the number of hulls without an answer.
struct Hits {
  std::vector<Hit> hits;
  uint64_t failed = 0;
};

absl::StatusOr<Hits> Cast(const Client& client, const Ray& ray, const v1::ListHullsResponse& list) {
  Hits found;
  const auto take = [&](const v1::FindCollisionsResponse& part) {
    found.failed += static_cast<uint64_t>(part.placement_problems_size());
    const int count = part.columns().relations_size();
    if (part.pairs_size() != 2 * count ||
        !AreParallel(part.columns(), static_cast<size_t>(count))) {
      return absl::InternalError("pairs or entries of columns are missing from the answers");
    }
    for (int i = 0; i < count; ++i) {
      // Placement 0 is the ray.
      const int hull = static_cast<int>(part.pairs(2 * i + 1)) - 1;
      if (hull < 0 || hull >= list.hulls_size()) {
        return absl::InternalError("an answer refers to a placement that is not in the request");
      }
      const AnswerRow row = RowAt(part.columns(), i);
      if (!row.first_contact || !row.first_contact->has_contact_time()) {
        ++found.failed;
        continue;
      }
      const double time = row.first_contact->contact_time();
      found.hits.push_back(
          {list.hulls(hull).hull_id(), time, ray.PointAt(time), NormalOf(*row.first_contact)});
    }
    return absl::OkStatus();
  };
  const absl::Status status = client.FindCollisions(ray.RequestFor(list), take);
  if (!status.ok()) return status;
  std::ranges::stable_sort(found.hits, {}, &Hit::time);
  return found;
}

std::string NumbersText(const Triple& numbers, const char* separator) {
  return absl::StrJoin(numbers, separator, [](std::string* out, double number) {
    absl::StrAppend(out, ShortestText(number));
  });
}

void Print(const Invocation& run, const Hits& found) {
  if (run.names()) {
    for (const Hit& hit : found.hits) run.out << hit.hull_id << "\n";
    return;
  }
  if (run.json()) {
    for (const Hit& hit : found.hits) {
      JsonObject object;
      object.Add("hullId", hit.hull_id)
          .AddJson("time", ShortestText(hit.time))
          .AddJson("point", "[" + NumbersText(hit.point, ",") + "]");
      if (hit.normal) object.AddJson("normal", "[" + NumbersText(*hit.normal, ",") + "]");
      run.out << object.Close() << "\n";
    }
    return;
  }
  Table table;
  table.Head(run.paint, {"HULL", "TIME", "POINT", "NORMAL"});
  for (const Hit& hit : found.hits) {
    table.Row({hit.hull_id, ShortestText(hit.time), NumbersText(hit.point, " "),
               hit.normal ? NumbersText(*hit.normal, " ") : "-"});
  }
  table.Print(run.out);
}

ExitCode CastRay(const Invocation& run, const CastArguments& arguments) {
  const Ray ray(arguments);
  if (!ray.HasFiniteEnd()) {
    return run.FailUsage("ORIGIN + DIRECTION exceeds the largest double; shorten the ray");
  }
  const Client client = run.MakeClient();
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto list, client.ListAllHulls(arguments.prefix));
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto found, Cast(client, ray, list));
  Print(run, found);
  if (found.failed == 0) return ExitCode::kDone;
  run.err << "hullctl: " << found.failed << " of " << Counted(list.hulls_size(), "hull")
          << " have no answer; they were deleted during the command; run it again\n";
  return ExitCode::kSomeFailed;
}

}  // namespace

void AddCastCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<CastArguments>();
  Command command = program.AddCommand("cast", "Find the hulls that a ray hits");
  command.AddParsed("ORIGIN", ParseTriple, &arguments->origin, "Start of the ray, x,y,z")
      .Required();
  command
      .AddParsed("DIRECTION", ParseTriple, &arguments->direction,
                 "Vector from the start of the ray to its end, x,y,z")
      .Required();
  command.AddText("PREFIX", &arguments->prefix, "Only hulls whose IDs start with this prefix")
      .Completes(ValueKind::kHull);
  AddFreshnessOptions(command, invocation);
  command.SetDetails(
      "The ray ends at ORIGIN + DIRECTION: the length of DIRECTION is that of the ray. Hits are\n"
      "sorted by time, from 0 at the start to 1 at the end, and are exact: a ray that grazes a\n"
      "corner hits the hull. A time that is not a double is rounded up to the next one. Hulls are\n"
      "not moved. NORMAL is the outward normal of the facet that the ray hits or, within rounding "
      "of\n"
      "an edge or a vertex, of some plane that has the hull on one side; - if the ray starts in "
      "the\n"
      "hull. Bodies are not searched.");
  command.SetExamples({{"What is below the origin?", "hullctl cast 0,0,0 0,0,-100"},
                       {"", "hullctl cast 0,0,0 100,0,0 robot/ --output name"}});
  OnGiven(command, invocation, arguments, CastRay);
}

}  // namespace hulld
