#ifndef HULLD_SERVER_WIRE_ENCODE_H_
#define HULLD_SERVER_WIRE_ENCODE_H_

#include <absl/status/status.h>
#include <google/protobuf/repeated_field.h>

#include <chrono>
#include <vector>

#include "core/hull/hull.h"
#include "core/hull/properties.h"
#include "core/query/body/piece_certification.h"
#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "google/protobuf/duration.pb.h"
#include "hulld/v1/collision.pb.h"
#include "hulld/v1/geometry.pb.h"
#include "hulld/v1/hull.pb.h"
#include "server/registry/registry.h"

namespace hulld::server {

void EncodeVector(const Vector& vector, v1::Vector3* message);
// Encodes a box into box_min and box_max of the message. Omits an empty one.
template <typename Message>
void EncodeBox(const Box& box, Message* message) {
  if (box.IsEmpty()) return;
  EncodeVector(box.low, message->mutable_box_min());
  EncodeVector(box.high, message->mutable_box_max());
}
void EncodeCounts(const PointCounts& counts, v1::PointCounts* message);
void EncodeHeader(const Store& store, uint64_t revision, v1::ResponseHeader* message);
// Adds the revision and staleness of a read.
void EncodeHeader(const Store& store, const AsOf& as_of, v1::ResponseHeader* message);
void EncodeRecord(const HullRecord& record, v1::HullInfo* message);
void EncodeProperties(const HullProperties& properties, v1::HullProperties* message);
void EncodeVersion(const Store& store, const HullRecord& record, v1::HullVersion* message);
void EncodeDuration(std::chrono::nanoseconds duration, google::protobuf::Duration* message);

v1::Relation EncodeRelation(Relation relation);
v1::Rung EncodeRung(Rung rung);
v1::AxisKind EncodeAxisKind(AxisKind kind);
v1::Durability EncodeDurability(Durability durability);

// a, b: the hulls separated by the axis. RESOURCE_EXHAUSTED: a feature has more vertices than fit
// in one message.
absl::Status EncodeAxis(const SeparatingAxis& axis, const Hull& a, const Hull& b,
                        v1::Axis* message);
void EncodeAnalysis(const Analysis& analysis, const Hull& a, const Hull& b, v1::Analysis* message);
// a, b: the hulls of the pairs' vertices.
void EncodeCertificate(const Certificate& certificate, const Hull& a, const Hull& b,
                       v1::Certificate* message);
// a, b: the hulls of its pieces.
void EncodePieceCertificate(const PieceCertificate& certificate, const Hull& a, const Hull& b,
                            v1::PieceCertificate* message);
void EncodeIntervals(const std::vector<SeparatedInterval>& intervals,
                     google::protobuf::RepeatedPtrField<v1::SeparatedInterval>* messages);
// Encodes times and intervals; the certificate belongs to another field.
void EncodeFirstContact(const FirstContact& contact, v1::FirstContact* message);
void EncodeSeparation(const Separation& separation, v1::Separation* message);
void EncodeWitness(const Witness& witness, v1::Witness* message);
void EncodeNormal(const Normal& normal, v1::Normal* message);

}  // namespace hulld::server

#endif  // HULLD_SERVER_WIRE_ENCODE_H_
