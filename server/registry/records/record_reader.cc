#include "server/registry/records/record_reader.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/base/check.h"
#include "server/contract/stopped_call.h"

namespace hulld::server {
namespace {

// IDs per store query, and threads that query.
constexpr size_t kMostAtOnce = kMostLookupsPerHold;
constexpr size_t kMostThreads = 2;

// The server never writes two records for one ID. The hull wins: its vertices cannot be restored.
void NoteBodyUnderHull(const std::string& id) {
  spdlog::error(
      "the store holds a body under the ID of hull \"{}\"; the body is ignored; delete one of the "
      "two",
      id);
}

}  // namespace

void RecordReader::WhenKnown(Locked& locked, const std::string& id, Refusal refuse,
                             LockedTask next) {
  HULLD_CHECK(locked.Holds(mutex_) && !catalog_.IsKnown(id));
  std::shared_ptr<Reading>& reading = readings_[id];
  const bool is_new = reading == nullptr;
  if (is_new) {
    reading = std::make_shared<Reading>();
    reading->id = id;
  }
  reading->waiting.emplace_back(std::move(refuse), std::move(next));
  if (!is_new) return;
  due_.push_back(reading);
  if (threads_ == kMostThreads) return;
  ++threads_;
  loaders_.Submit([this] { ReadDue(); }, kRecordReader);
}

// Sends one query; IDs that arrive during it go into the next one. The thread is offered to other
// clients in between, so that a steady supply of IDs does not starve them.
void RecordReader::ReadDue() {
  Locked locked(mutex_);
  if (!due_.empty()) {
    const auto first = due_.begin();
    const auto last = first + std::min<ptrdiff_t>(due_.size(), kMostAtOnce);
    const Readings taken(first, last);
    due_.erase(first, last);
    ReadRecords(locked, taken);
  }
  if (due_.empty()) {
    --threads_;
  } else {
    loaders_.Submit([this] { ReadDue(); }, kRecordReader);
  }
}

absl::Status RecordReader::AwaitKnown(Locked& locked, std::span<const std::string* const> ids,
                                      const std::function<bool()>& should_stop) {
  HULLD_CHECK(!ids.empty() && ids.size() <= kMostAtOnce);
  // Runs the deferred tasks before waiting.
  locked.Unlock();
  locked.Lock();
  Readings own;
  std::shared_ptr<Reading> awaited;
  for (const std::string* const id : ids) {
    locked.NoteLookup();
    if (catalog_.IsKnown(*id)) {
      if (awaited == nullptr) return absl::OkStatus();
      continue;
    }
    std::shared_ptr<Reading>& reading = readings_[*id];
    if (reading == nullptr) {
      reading = std::make_shared<Reading>();
      reading->id = *id;
      own.push_back(reading);
    }
    if (awaited == nullptr) awaited = reading;
  }
  if (!own.empty()) ReadRecords(locked, own);
  const auto is_over = [&] { return awaited->is_over; };
  while (!is_over()) {
    if (Stopped(should_stop)) return Cancelled();
    locked.WaitOn([&](auto& lock) { awaited->over.wait_for(lock, kStopPoll, is_over); });
  }
  return awaited->status;
}

absl::Status RecordReader::AwaitMissing(Locked& locked, std::span<const std::string> ids,
                                        const std::function<bool()>& should_stop) {
  if (absl::Status s = memory_.Check(locked, MemoryUse::kReading); !s.ok()) return s;
  std::vector<const std::string*> missing;
  for (const std::string& id : ids) {
    if (!catalog_.IsKnown(id)) missing.push_back(&id);
  }
  const absl::Status read = AwaitKnown(locked, missing, should_stop);
  if (Stopped(should_stop)) return Cancelled();
  return read;
}

// Releases the mutex during the read. The readings may end later than this call.
void RecordReader::ReadRecords(Locked& locked, const Readings& readings) {
  std::vector<std::string> ids;
  ids.reserve(readings.size());
  for (const auto& reading : readings) ids.push_back(reading->id);
  const uint64_t asked_at = catalog_.revision();
  locked.Unlock();
  absl::StatusOr<FoundRecords> found = store_.FindRecords(ids);
  locked.Lock();
  gate_.WhenReached(locked, asked_at, std::move(found),
                    [this, readings](Locked& later, const absl::StatusOr<FoundRecords>& reached) {
                      TakeRecords(later, readings, reached);
                    });
}

void RecordReader::TakeRecords(Locked& locked, const Readings& readings,
                               const absl::StatusOr<FoundRecords>& found) {
  // Evicts first, so that the new records are still there when their callers resume.
  for (size_t i = 0; i < readings.size(); ++i) catalog_.hulls().RestSome();
  catalog_.bodies().DropSome(locked);
  Readings open;
  for (const auto& reading : readings) {
    if (reading->is_over) continue;
    if (found.ok()) TakeRecord(locked, reading->id, *found);
    open.push_back(reading);
  }
  for (const auto& reading : open) EndReading(locked, *reading, found.status());
}

void RecordReader::TakeRecord(Locked& locked, const std::string& id, const FoundRecords& found) {
  HULLD_CHECK(!catalog_.IsKnown(id));
  const auto hull = found.hulls.find(id);
  const auto body = found.bodies.find(id);
  const bool has_hull = hull != found.hulls.end();
  const bool has_body = body != found.bodies.end();
  if (!has_hull && !has_body) return catalog_.hulls().NoteAbsent(id);
  if (!has_hull) return catalog_.AddBody(locked, id, body->second);
  if (has_body) NoteBodyUnderHull(id);
  catalog_.AddStored(id, hull->second);
}

void RecordReader::EndReading(Locked& locked, Reading& reading, const absl::Status& status) {
  reading.is_over = true;
  reading.status = status;
  reading.over.notify_all();
  readings_.erase(reading.id);
  for (auto& [refuse, next] : std::exchange(reading.waiting, {})) {
    if (status.ok()) {
      next(locked);
    } else {
      locked.Afterwards([refuse = std::move(refuse), status] { refuse(status); });
    }
  }
}

std::vector<LockedTask> RecordReader::EndReadingOf(const std::string& id) {
  std::vector<LockedTask> waiting;
  const auto found = readings_.find(id);
  if (found == readings_.end()) return waiting;
  const std::shared_ptr<Reading> reading = found->second;
  if (!catalog_.IsKnown(id)) catalog_.hulls().NoteAbsent(id);
  reading->is_over = true;
  reading->over.notify_all();
  readings_.erase(found);
  for (auto& [refuse, next] : std::exchange(reading->waiting, {})) {
    waiting.push_back(std::move(next));
  }
  return waiting;
}

}  // namespace hulld::server
