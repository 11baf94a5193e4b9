// Queries a server end to end: smoke_client ADDRESS. Prints the relations of two unit cubes that
// are separated by one unit in the last place, touch, and overlap by as little.

#include <iostream>

#include "client/client.h"

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "smoke_client: expected the address of a server\n", 2;
  hulld::ClientOptions options;
  options.server = argv[1];
  hulld::Client client(options);
  hulld::v1::PointBlock corners;
  for (double x : {0, 1}) {
    for (double y : {0, 1}) {
      for (double z : {0, 1}) {
        for (double coordinate : {x, y, z}) corners.add_xyz(coordinate);
      }
    }
  }
  hulld::AppendOptions append;
  append.create_if_absent = true;
  auto stream = client.OpenAppend("cube", append);
  absl::Status status = stream.status();
  if (status.ok()) status = (*stream)->Append(corners);
  if (status.ok()) status = (*stream)->Finish();
  for (double x : {1 + 0x1p-52, 1.0, 1 - 0x1p-53}) {
    if (!status.ok()) return std::cerr << status << "\n", 1;
    hulld::v1::CheckCollisionRequest request;
    request.mutable_a()->set_hull_id("cube");
    request.mutable_b()->set_hull_id("cube");
    request.mutable_b()->mutable_pose()->mutable_translation()->set_x(x);
    const auto answer = client.CheckCollision(request);
    status = answer.status();
    if (answer.ok()) std::cout << hulld::v1::Relation_Name(answer->relation()) << "\n";
  }
  return status.ok() ? 0 : 1;
}
