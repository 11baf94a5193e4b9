// A third-party program: appends a cube, queries it, and verifies the certificate of the answer.
#include <cstdio>
#include <string>

#include "client/client.h"
#include "client/verify/answer_check.h"

namespace {

int Fail(const char* what, const absl::Status& status) {
  std::fprintf(stderr, "%s: %s\n", what, status.ToString().c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  hulld::ClientOptions options;
  options.server = argv[1];
  const std::string id = argv[2];
  const hulld::Client client(options);
  auto appender = client.OpenAppend(id);
  if (!appender.ok()) return Fail("OpenAppend", appender.status());
  hulld::v1::PointBlock cube;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) cube.add_xyz(corner >> axis & 1);
  }
  if (absl::Status s = (*appender)->Append(cube); !s.ok()) return Fail("Append", s);
  if (absl::Status s = (*appender)->Finish(); !s.ok()) return Fail("Finish", s);

  hulld::v1::CheckCollisionRequest request;
  request.mutable_a()->set_hull_id(id);
  request.mutable_b()->set_hull_id(id);
  request.mutable_b()->mutable_pose()->mutable_translation()->set_x(1);
  const auto answer = hulld::CheckCollisionVerified(client, request);
  if (!answer.ok()) return Fail("CheckCollision", answer.status());
  std::printf("%s\n", hulld::v1::Relation_Name(answer->response.relation()).c_str());
  return answer->response.relation() == hulld::v1::RELATION_TOUCHING ? 0 : 1;
}
