#include "tests/server/schedules/simulation.h"

#include <absl/strings/str_cat.h>

#include <memory>
#include <vector>

#include "server/process/synchronization.h"
#include "server/process/task_pool.h"
#include "tests/server/schedules/client.h"
#include "tests/server/schedules/collision_watcher.h"
#include "tests/server/schedules/store/shared_store.h"
#include "tests/server/schedules/watcher.h"

namespace hulld::server {
namespace {

constexpr uint64_t kPlentyOfMemory = uint64_t{1} << 30;
// Upper bound for a body of one piece.
constexpr uint64_t kMaxBytesOfBody = 512;

// Checks the statistics of an idle registry: it has the contents of the store, can evict all of
// them, and then counts nothing.
void CheckAtRest(const Simulation& simulation) {
  Scheduler& scheduler = Scheduler::Current();
  const Ledger& ledger = simulation.ledger();
  Registry& registry = simulation.registry;
  uint64_t hulls = 0;
  uint64_t vertices = 0;
  uint64_t bodies = 0;
  for (size_t hull = 0; hull < kHulls; ++hull) {
    bodies += ledger.Last(hull).is_body;
    if (!ledger.Last(hull).exists) continue;
    ++hulls;
    vertices += ledger.Last(hull).record.vertex_count;
  }
  const RegistrySizes sizes = registry.Sizes();
  if (sizes.hull_count != hulls || sizes.vertex_count != vertices || sizes.body_count != bodies ||
      sizes.store_revision != ledger.revision()) {
    scheduler.Fail(absl::StrCat("the registry counts ", sizes.hull_count, " hulls of ",
                                sizes.vertex_count, " vertices and ", sizes.body_count,
                                " bodies at revision ", sizes.store_revision,
                                ", but the store has ", hulls, " of ", vertices, " and ", bodies,
                                " at ", ledger.revision()));
  }
  if (auto fault = ledger.Unclaimed()) scheduler.Fail(*fault);
  if (registry.Cache().damaged > 0 && !simulation.store.has_damage()) {
    scheduler.Fail("a hull is reported as damaged, but none is");
  }
  {
    const MemoryCharge charge(registry.memory(), MemoryUse::kReading,
                              simulation.plan.memory_limit + 1);
    registry.CheckMemory(MemoryUse::kWriting).IgnoreError();
  }
  const CacheStatistics cache = registry.Cache();
  simulation.reached.evictions += cache.evictions;
  // A preparation in progress is held slightly longer, and so are recently put bodies: each client
  // puts kMaxCalls at most.
  if (simulation.plan.bodies > 0) bodies += simulation.plan.clients * Client::kMaxCalls;
  if (simulation.plan.preparations > 0 || cache.bytes <= bodies * kMaxBytesOfBody) return;
  scheduler.Fail(absl::StrCat("nothing is in use, but ", cache.bytes,
                              " bytes are counted: ", cache.reading_bytes, " for readers and ",
                              cache.writing_bytes, " for writers"));
}

void RunClients(Simulation& simulation) {
  std::shared_ptr<Watcher> watcher;
  std::vector<std::unique_ptr<Client>> clients;
  std::vector<Thread> threads;
  threads.reserve(simulation.plan.clients + 2);
  for (size_t i = 0; i < simulation.plan.clients; ++i) {
    clients.push_back(std::make_unique<Client>(simulation));
    threads.emplace_back([client = clients.back().get()] { client->Run(); }, "client");
  }
  if (simulation.plan.has_watch) {
    watcher = std::make_shared<Watcher>(simulation);
    threads.emplace_back([watcher] { watcher->Run(); }, "watcher");
  }
  std::shared_ptr<CollisionWatcher> collisions;
  if (simulation.plan.has_collision_watch) {
    collisions = std::make_shared<CollisionWatcher>(simulation);
    threads.emplace_back([collisions] { collisions->Run(); }, "collision watcher");
  }
  for (size_t i = 0; i < clients.size(); ++i) threads[i].join();
  if (watcher != nullptr) watcher->End();
  if (collisions != nullptr) collisions->End();
  for (size_t i = clients.size(); i < threads.size(); ++i) threads[i].join();
}

void CountStore(const SimulatedStore::Counts& counts, Reached& reached) {
  reached.loads += counts.loads;
  reached.sequences += counts.sequences;
  reached.lookups += counts.lookups;
  reached.recovered += counts.recovered;
  reached.kills += counts.kills;
  reached.revived += counts.revived;
  reached.superseded += counts.superseded;
}

// The registry has applied all peer changes.
void CatchUp(Registry& registry) {
  absl::Status status = absl::UnavailableError("");
  while (absl::IsUnavailable(status)) status = registry.peers().AwaitPeers({});
}

void SimulateServers(const Plan& plan, SimulatedStore& database, Reached& reached) {
  Limits limits;
  limits.memory_limit = plan.memory_limit;
  size_t working = plan.servers;
  Event all_ended;
  const auto serve = [&] {
    SharedStore store(database);
    TaskPool writers(2);
    Registry registry(store, limits, writers);
    if (plan.supports_lookup) registry.SetRecordCapacity(plan.records);
    if (!registry.Load().ok())
      Scheduler::Current().Fail("the contents of the database cannot be loaded");
    Simulation simulation{plan, database, registry, reached};
    RunClients(simulation);
    if (--working == 0) all_ended.Set();
    // Some end while others continue.
    if (Scheduler::Current().random().OneIn(3)) return;
    all_ended.Wait();
    CatchUp(registry);
    CheckAtRest(simulation);
  };
  std::vector<Thread> servers;
  servers.reserve(plan.servers);
  for (size_t i = 0; i < plan.servers; ++i) servers.emplace_back(serve, "server");
  for (Thread& server : servers) server.join();
  ++reached.shared;
}

}  // namespace

void Event::Set() {
  is_set_ = true;
  Scheduler::Current().Notify(this);
}

void Event::Wait(const std::source_location& where) {
  const auto holds = [](const void* set) { return *static_cast<const bool*>(set); };
  Scheduler::Current().WaitUntil(this, {holds, &is_set_}, where);
}

Plan::Plan(Random& random) {
  const auto rarely = [&random](uint32_t often) -> uint32_t {
    return random.OneIn(2) ? 0 : often << random.Below(4);
  };
  const auto weight = [&random] { return random.Below(3); };
  if (random.OneIn(2)) {
    faults.refused = rarely(3);
    faults.unknown = rarely(4);
    faults.full = rarely(8);
    faults.recover = rarely(2);
    faults.read = rarely(4);
    if (random.OneIn(3)) faults.damage = rarely(2);
    if (random.OneIn(2)) faults.killed_at_batch = 1 + random.Below(8);
  }
  memory_limit = random.OneIn(2) ? kPlentyOfMemory : uint64_t{1000} << random.Below(6);
  has_memory = memory_limit == kPlentyOfMemory;
  clients = 2 + random.Below(2);
  hulls = 1 + random.Below(kHulls);
  writers = 1 + random.Below(kWriters);
  has_watch = random.OneIn(4);
  creations = weight();
  deletions = weight();
  replacements = weight();
  streams = 1 + 2 * weight();
  reads = weight();
  listings = random.OneIn(4) ? 1 : 0;
  pressure = random.OneIn(2) ? 0 : weight();
  conditions = rarely(2);
  cancellations = rarely(2);
  preparations = random.OneIn(2) ? 0 : rarely(1);
  repetitions = rarely(2);
  supports_lookup = random.OneIn(2);
  records = random.Below(3);
  bodies = random.OneIn(2) ? 1 + weight() : 0;
  if (random.OneIn(16)) {
    // Several read cold hulls, and some of them are cancelled.
    clients = 3;
    hulls = creations = streams = 1;
    deletions = replacements = listings = bodies = preparations = 0;
    reads = 6;
    pressure = 3;
    cancellations = 2;
  }
  has_collision_watch = bodies > 0 && hulls > 1 && random.OneIn(2);
  if (!random.OneIn(3)) return;
  servers = 2;
  // A watch may report several changes as one.
  has_watch = has_collision_watch = false;
  faults.damage = 0;
  faults.killed_at_batch = 0;
  if (!supports_lookup) bodies = 0;
}

void Simulate(Reached& reached) {
  const Plan plan(Scheduler::Current().random());
  SimulatedStore store(plan.faults);
  store.SetFindsRecords(plan.supports_lookup);
  if (plan.servers > 1) {
    SimulateServers(plan, store, reached);
    return CountStore(store.counts(), reached);
  }
  Limits limits;
  limits.memory_limit = plan.memory_limit;
  const auto run = [&](const auto& body) {
    TaskPool writers(2);
    Registry registry(store, limits, writers);
    if (plan.supports_lookup) registry.SetRecordCapacity(plan.records);
    if (!registry.Load().ok())
      Scheduler::Current().Fail("the contents of the store cannot be loaded");
    Simulation simulation{plan, store, registry, reached};
    body(simulation);
    CheckAtRest(simulation);
  };
  run([](Simulation& simulation) { RunClients(simulation); });
  if (store.was_killed() || Scheduler::Current().random().OneIn(4)) {
    Scheduler::Current().Note("test: reopens the store");
    store.Reopen({});
    run([](Simulation& simulation) { Client(simulation).CheckAll(); });
  }
  // Hulls that are initially cold.
  if (Scheduler::Current().random().OneIn(3)) {
    Scheduler::Current().Note("test: opens the store for clients");
    StoreFaults faults = plan.faults;
    faults.killed_at_batch = 0;
    store.Reopen(faults);
    run([](Simulation& simulation) { RunClients(simulation); });
  }
  CountStore(store.counts(), reached);
}

}  // namespace hulld::server
