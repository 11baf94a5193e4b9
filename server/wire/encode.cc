#include "server/wire/encode.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/util/time_util.h>

#include <array>
#include <variant>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"
#include "server/settings/config.h"

namespace hulld::server {
namespace {

absl::Status EncodeFeature(const Feature& feature, const Hull& hull, v1::Feature* message) {
  if (feature.vertices.size() > Config::kMaxFeatureVertices) {
    return WithReason(absl::ResourceExhaustedError(
                          absl::StrCat("the axis touches a feature of ", feature.vertices.size(),
                                       " vertices; a reply can hold at most ",
                                       Config::kMaxFeatureVertices, "; retry without the axis")),
                      v1::ERROR_REASON_FEATURE_TOO_LARGE,
                      {{"limit", uint64_t{Config::kMaxFeatureVertices}}});
  }
  for (const uint32_t index : feature.vertices) {
    message->add_vertex_indices(index);
    const Vector& vertex = hull.vertices()[index];
    for (int i = 0; i < 3; ++i) message->add_xyz(vertex[i]);
  }
  if (feature.facet.has_value()) message->set_facet_index(*feature.facet);
  return absl::OkStatus();
}

// Integer::str() triggers a false warning in GCC 12.
std::string Decimal(const Integer& number) {
  if (number.is_zero()) return "0";
  const Integer base = 1'000'000'000'000'000'000;
  Integer rest = abs(number);
  std::string digits;  // least significant first
  while (!rest.is_zero()) {
    auto part = static_cast<uint64_t>(Integer(rest % base));
    rest /= base;
    for (int i = 0; i < 18 && (part > 0 || !rest.is_zero()); ++i, part /= 10) {
      digits.push_back(static_cast<char>('0' + part % 10));
    }
  }
  if (number.sign() < 0) digits.push_back('-');
  return {digits.rbegin(), digits.rend()};
}

void EncodeSize(const Hull& hull, v1::HullSize* message) {
  message->set_vertices(hull.vertices().size());
  message->set_edges(hull.edges().size());
  message->set_facets(hull.facet_count());
}

// Direction: a variant that may contain a Vector or an IntegerVector. Message: a message with an
// exact_direction.
template <typename Direction, typename Message>
void EncodeDirection(const Direction& direction, Message* message) {
  if (const Vector* n = std::get_if<Vector>(&direction)) {
    EncodeVector(*n, message->mutable_direction());
  } else if (const auto* integers = std::get_if<IntegerVector>(&direction)) {
    message->mutable_integer_direction()->set_x(Decimal(integers->x));
    message->mutable_integer_direction()->set_y(Decimal(integers->y));
    message->mutable_integer_direction()->set_z(Decimal(integers->z));
  }
}

}  // namespace

void EncodeVector(const Vector& vector, v1::Vector3* message) {
  message->set_x(vector[0]);
  message->set_y(vector[1]);
  message->set_z(vector[2]);
}

void EncodeCounts(const PointCounts& counts, v1::PointCounts* message) {
  message->set_received(counts.received);
  message->set_outside(counts.outside);
  message->set_duplicate(counts.duplicate);
  message->set_inside(counts.inside);
}

void EncodeHeader(const Store& store, uint64_t revision, v1::ResponseHeader* message) {
  message->set_store_id(store.id());
  message->set_revision(revision);
}

void EncodeHeader(const Store& store, const AsOf& as_of, v1::ResponseHeader* message) {
  EncodeHeader(store, as_of.revision, message);
  if (as_of.staleness.count() > 0) EncodeDuration(as_of.staleness, message->mutable_staleness());
}

void EncodeRecord(const HullRecord& record, v1::HullInfo* message) {
  message->set_hull_id(record.hull_id);
  message->set_create_revision(record.create_revision);
  message->set_revision(record.revision);
  message->set_dimension(record.dimension);
  message->set_vertex_count(record.vertex_count);
  EncodeCounts(record.counts, message->mutable_counts());
}

void EncodeProperties(const HullProperties& properties, v1::HullProperties* message) {
  message->mutable_volume()->set_value(properties.volume.value);
  message->mutable_volume()->set_bound(properties.volume.bound);
  message->mutable_area()->set_value(properties.area.value);
  message->mutable_area()->set_bound(properties.area.bound);
  const auto& c = properties.centroid;
  EncodeVector({c[0].value, c[1].value, c[2].value}, message->mutable_centroid());
  EncodeVector({c[0].bound, c[1].bound, c[2].bound}, message->mutable_centroid_bounds());
  const auto encode = [&](double Rounded::*member, v1::SymmetricTensor* tensor) {
    tensor->set_xx(properties.inertia[0].*member);
    tensor->set_yy(properties.inertia[1].*member);
    tensor->set_zz(properties.inertia[2].*member);
    tensor->set_xy(properties.inertia[3].*member);
    tensor->set_xz(properties.inertia[4].*member);
    tensor->set_yz(properties.inertia[5].*member);
  };
  encode(&Rounded::value, message->mutable_inertia());
  encode(&Rounded::bound, message->mutable_inertia_bounds());
}

void EncodeVersion(const Store& store, const HullRecord& record, v1::HullVersion* message) {
  if (record.hull_id.empty()) return;
  message->set_hull_id(record.hull_id);
  message->set_create_revision(record.create_revision);
  message->set_revision(record.revision);
  message->set_store_id(store.id());
}

void EncodeDuration(std::chrono::nanoseconds duration, google::protobuf::Duration* message) {
  *message = google::protobuf::util::TimeUtil::NanosecondsToDuration(duration.count());
}

// The arrays of the next functions are in the order of the encoded enums.
v1::Relation EncodeRelation(Relation relation) {
  static constexpr std::array kRelations = {v1::RELATION_SEPARATED, v1::RELATION_TOUCHING,
                                            v1::RELATION_OVERLAPPING,
                                            v1::RELATION_WITHIN_TOLERANCE};
  return kRelations[static_cast<size_t>(relation)];
}

v1::Rung EncodeRung(Rung rung) {
  static constexpr std::array kRungs = {v1::RUNG_BOUNDS, v1::RUNG_CACHED, v1::RUNG_FLOATING_POINT,
                                        v1::RUNG_EXACT};
  return kRungs[static_cast<size_t>(rung)];
}

v1::AxisKind EncodeAxisKind(AxisKind kind) {
  static constexpr std::array kKinds = {v1::AXIS_KIND_FACET_A, v1::AXIS_KIND_FACET_B,
                                        v1::AXIS_KIND_EDGE_EDGE, v1::AXIS_KIND_FLAT,
                                        v1::AXIS_KIND_GENERAL};
  return kKinds[static_cast<size_t>(kind)];
}

v1::Durability EncodeDurability(Durability durability) {
  static constexpr std::array kDurabilities = {v1::DURABILITY_MEMORY, v1::DURABILITY_RELAXED,
                                               v1::DURABILITY_SYNC};
  return kDurabilities[static_cast<size_t>(durability)];
}

absl::Status EncodeAxis(const SeparatingAxis& axis, const Hull& a, const Hull& b,
                        v1::Axis* message) {
  EncodeVector(axis.direction, message->mutable_direction());
  message->set_kind(EncodeAxisKind(axis.kind));
  HULLD_RETURN_IF_ERROR(EncodeFeature(axis.feature_a, a, message->mutable_feature_a()));
  return EncodeFeature(axis.feature_b, b, message->mutable_feature_b());
}

void EncodeAnalysis(const Analysis& analysis, const Hull& a, const Hull& b, v1::Analysis* message) {
  EncodeDuration(analysis.time, message->mutable_time());
  EncodeSize(a, message->mutable_size_a());
  EncodeSize(b, message->mutable_size_b());
  message->set_axes_tested(analysis.axes_tested);
  message->set_axes_total(analysis.axes_total);
  if (analysis.stage.has_value()) message->set_stage(EncodeAxisKind(*analysis.stage));
  if (analysis.axis_index.has_value()) message->set_axis_index(*analysis.axis_index);
}

void EncodeCertificate(const Certificate& certificate, const Hull& a, const Hull& b,
                       v1::Certificate* message) {
  EncodeDirection(certificate.direction, message);
  for (const VertexPair& pair : certificate.pairs) {
    v1::VertexPair* const encoded = message->add_pairs();
    encoded->set_index_a(pair.a);
    encoded->set_index_b(pair.b);
    EncodeVector(a.vertices()[pair.a], encoded->mutable_vertex_a());
    EncodeVector(b.vertices()[pair.b], encoded->mutable_vertex_b());
  }
}

void EncodePieceCertificate(const PieceCertificate& certificate, const Hull& a, const Hull& b,
                            v1::PieceCertificate* message) {
  message->set_piece_a(certificate.pieces.a);
  message->set_piece_b(certificate.pieces.b);
  message->set_relation(EncodeRelation(certificate.relation));
  const Certificate& of_pair = certificate.certificate;
  if (!of_pair.pairs.empty() || of_pair.direction.index() != 0) {
    EncodeCertificate(of_pair, a, b, message->mutable_certificate());
  }
  EncodeIntervals(certificate.intervals, message->mutable_intervals());
}

void EncodeFirstContact(const FirstContact& contact, v1::FirstContact* message) {
  message->set_separated_until(contact.separated_until);
  if (contact.contact_time.has_value()) message->set_contact_time(*contact.contact_time);
  EncodeIntervals(contact.intervals, message->mutable_intervals());
}

void EncodeIntervals(const std::vector<SeparatedInterval>& intervals,
                     google::protobuf::RepeatedPtrField<v1::SeparatedInterval>* messages) {
  for (const SeparatedInterval& interval : intervals) {
    v1::SeparatedInterval* const message = messages->Add();
    message->set_until(interval.until);
    EncodeDirection(interval.direction, message);
    if (interval.offset.has_value()) message->set_offset(*interval.offset);
    if (interval.end.has_value()) {
      EncodeVector(interval.end->direction, message->mutable_end_direction());
      message->set_end_offset(interval.end->offset);
    }
  }
}

void EncodeSeparation(const Separation& separation, v1::Separation* message) {
  message->set_value(separation.value);
  message->set_bound(separation.bound);
}

void EncodeWitness(const Witness& witness, v1::Witness* message) {
  EncodeVector(witness.p_WA, message->mutable_point_a());
  EncodeVector(witness.p_WB, message->mutable_point_b());
  message->set_error(witness.error);
}

void EncodeNormal(const Normal& normal, v1::Normal* message) {
  EncodeVector(normal.direction, message->mutable_direction());
  message->set_angle_bound(normal.angle_bound);
}

}  // namespace hulld::server
