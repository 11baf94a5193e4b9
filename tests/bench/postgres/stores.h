#ifndef HULLD_TESTS_BENCH_POSTGRES_STORES_H_
#define HULLD_TESTS_BENCH_POSTGRES_STORES_H_

#include <memory>
#include <string>

#include "tests/bench/postgres/libpq_floor.h"
#include "tests/bench/postgres/suites.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {

// Where chunks of one point go.
constexpr char kGrowingHull[] = "commit/hull";

// The databases of this run, and how hulld is started over them.
class Stores {
 public:
  // arguments: outlives this.
  explicit Stores(const Arguments& arguments);

  std::string Conninfo(const std::string& database) const;
  // An empty one.
  void Make(const std::string& database) const;

  // kind: rocksdb, one, many or shard; the last is many, in a file of one shard. name: the name of
  // the database or directory.
  std::unique_ptr<ChildServer> Start(const std::string& kind, const std::string& name) const;
  // The same, over nothing.
  std::unique_ptr<ChildServer> StartEmpty(const std::string& kind, const std::string& name) const;
  std::unique_ptr<ChildServer> StartEmpty(const std::string& kind) const {
    return StartEmpty(kind, "bench_" + kind);
  }
  // gRPC alone.
  std::unique_ptr<ChildServer> StartFloor() const;

  // libpq alone, repeating what a hulld of this kind left in a database that is made for it: a
  // hull with a writer of chunks of one point.
  std::unique_ptr<LibpqFloor> MakeLibpqFloor(const std::string& kind,
                                             const std::string& database) const;

 private:
  const Arguments& arguments_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_POSTGRES_STORES_H_
