
#include <cmath>
#include <memory>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/load/point_generator.h"
#include "client/hullctl/printing/progress_bar.h"

namespace hulld {
namespace {

struct GenerateArguments {
  CloudOptions cloud;
  std::string file;
};

// Returns true if every possible coordinate is finite.
bool IsFinite(const CloudOptions& cloud) {
  const bool round = cloud.shape == Shape::kBall || cloud.shape == Shape::kSphere;
  double reach = round ? cloud.radius : cloud.size / 2;
  if (cloud.shape == Shape::kLattice) {
    reach = cloud.size * static_cast<double>(LatticeSide(cloud.count));
  }
  for (const double center : cloud.center) {
    if (!std::isfinite(std::abs(center) + reach)) return false;
  }
  return true;
}

ExitCode Generate(const Invocation& run, const GenerateArguments& arguments) {
  const CloudOptions& cloud = arguments.cloud;
  if (!IsFinite(cloud)) {
    return run.FailUsage(
        "a coordinate exceeds the largest double; use a smaller --radius, --size, or --center");
  }
  const bool to_file = !arguments.file.empty() && arguments.file != "-";
  ProgressBar bar(run.err, run.shows_progress && to_file, "points", cloud.count);
  uint64_t done = 0;
  const ExitCode written = run.WriteFile(arguments.file, [&](std::ostream& out) {
    GenerateCloud(cloud, [&](const std::array<double, 3>& p) {
      if (!out) return;
      if (++done % 4096 == 0) bar.Update(done);
      out << ShortestText(p[0]) << ' ' << ShortestText(p[1]) << ' ' << ShortestText(p[2]) << '\n';
    });
  });
  bar.Clear();
  return written;
}

}  // namespace

void AddGenerateCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<GenerateArguments>();
  CloudOptions* const cloud = &arguments->cloud;
  Command command = program.AddCommand("generate", "Write points as XYZ text; needs no server");
  command
      .AddChoice("SHAPE",
                 {{"ball", Shape::kBall},
                  {"sphere", Shape::kSphere},
                  {"cube", Shape::kCube},
                  {"lattice", Shape::kLattice}},
                 &cloud->shape, "Shape that the points fill")
      .Required();
  command.AddNumber("N", 0, uint64_t{1} << 40, "Number of points", &cloud->count).Required();
  command.AddNumber("--seed", 0, kAnyNumber, "Seed of the points (default 1)", &cloud->seed);
  command.AddLength("--radius", "Radius of ball and sphere (default 1)", &cloud->radius);
  command.AddLength("--size", "Edge of the cube, step of the lattice (default 1)", &cloud->size);
  command
      .AddParsed("--center", ParseTriple, &cloud->center,
                 "Center; for the lattice, its first point (default 0,0,0)")
      .ValueName("x,y,z");
  command.AddText("-o,--out", &arguments->file, "File to write (default: standard output)")
      .ValueName("FILE");
  command.SetDetails(
      "The same options produce the same bytes on every machine. A lattice of N points is the\n"
      "first N points of the smallest cube of k*k*k points; N = k*k*k results in a whole cube.");
  command.SetExamples(
      {{"A cube of edge 2", "hullctl generate lattice 27 | hullctl append cube - --create"},
       {"A hundred thousand points in a ball", "hullctl generate ball 100000 -o ball.xyz"}});
  OnGiven(command, invocation, arguments, Generate, /*needs_server=*/false);
}

}  // namespace hulld
