#ifndef HULLD_TESTS_BENCH_POSTGRES_STORES_H_
#define HULLD_TESTS_BENCH_POSTGRES_STORES_H_

#include <memory>
#include <string>

#include "tests/bench/postgres/libpq_floor.h"
#include "tests/bench/postgres/suites.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {

// The hull that receives single-point chunks.
constexpr char kGrowingHull[] = "commit/hull";

// The databases of this run, and the start of hulld over them.
class Stores {
 public:
  // arguments: must outlive this.
  explicit Stores(const Arguments& arguments);

  std::string Conninfo(const std::string& database) const;
  // Creates an empty database.
  void Make(const std::string& database) const;

  // kind: rocksdb, one or many. name: the name of the database or directory.
  std::unique_ptr<ChildServer> Start(const std::string& kind, const std::string& name) const;
  // Like Start, but over an empty store.
  std::unique_ptr<ChildServer> StartEmpty(const std::string& kind, const std::string& name) const;
  std::unique_ptr<ChildServer> StartEmpty(const std::string& kind) const {
    return StartEmpty(kind, "bench_" + kind);
  }
  // Starts gRPC alone.
  std::unique_ptr<ChildServer> StartFloor() const;

  // Returns libpq alone, over a new database in which a hulld of this kind has stored a hull and
  // the writer of its single-point chunks.
  std::unique_ptr<LibpqFloor> MakeLibpqFloor(const std::string& kind,
                                             const std::string& database) const;

 private:
  const Arguments& arguments_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_POSTGRES_STORES_H_
