#ifndef HULLD_TESTS_BENCH_SERVICE_BALL_HULL_H_
#define HULLD_TESTS_BENCH_SERVICE_BALL_HULL_H_

#include <grpcpp/grpcpp.h>

#include <string>

#include "hulld/v1/hull.grpc.pb.h"

namespace hulld::bench {

// Ends the program with a message if a call failed.
void Require(const grpc::Status& status, const char* what);

// Creates a hull of evenly spread points on a sphere around the origin (Fibonacci).
void MakeBallHull(v1::HullService::Stub& stub, const std::string& hull_id, int points,
                  double radius);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_SERVICE_BALL_HULL_H_
