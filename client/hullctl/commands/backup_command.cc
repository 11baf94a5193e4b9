#include <memory>
#include <string>

#include "client/backup_file.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct BackupArguments {
  std::string file;
  std::string data_dir;
};

void PrintBackup(const Invocation& run, const std::string& what, const BackupCheck& backup) {
  const v1::ResponseHeader& header = backup.begin().header();
  const v1::BackupEnd& totals = backup.totals();
  JsonObject json;
  json.Add("storeId", header.store_id())
      .Add("revision", header.revision())
      .Add("files", totals.file_count())
      .Add("bytes", totals.byte_count());
  if (run.PrintForPrograms(json.Close(), header.store_id())) return;
  Table table;
  table.Row({"backup", what})
      .Row({"store", header.store_id()})
      .Row({"revision", "at least " + std::to_string(header.revision())})
      .Row({"bytes",
            std::to_string(totals.byte_count()) + " in " + Counted(totals.file_count(), "file")});
  table.Print(run.out);
}

ExitCode Save(const Invocation& run, const BackupArguments& arguments) {
  BackupWriter writer(arguments.file);
  ProgressBar bar(run.err, run.shows_progress, "B", 0);
  uint64_t bytes = 0;
  if (absl::Status s = writer.Open(); !s.ok()) return run.FailUsage(s);
  absl::Status file_error;
  const absl::Status called = run.MakeClient().SaveBackup(
      [&](const v1::SaveBackupResponse& part) {
        file_error = writer.Write(part);
        bytes += part.ByteSizeLong();
        bar.Update(bytes);
        return file_error;
      },
      run.given_timeout);
  bar.Clear();
  if (!file_error.ok()) return run.FailUsage(file_error);
  if (!called.ok()) return run.Fail(called);
  if (absl::Status s = writer.Finish(); !s.ok()) return run.FailUsage(s);
  PrintBackup(run, "saved to " + arguments.file, writer.check());
  return ExitCode::kDone;
}

ExitCode Restore(const Invocation& run, const BackupArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto restored,
                       RestoreBackup(arguments.file, arguments.data_dir));
  PrintBackup(run, "restored to " + arguments.data_dir, restored);
  return ExitCode::kDone;
}

}  // namespace

void AddBackupCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<BackupArguments>();
  Command command = program.AddCommand("backup", "Save and restore the whole store");
  command.RequireCommand();
  Command save = command.AddCommand("save", "Save a backup while hulld keeps serving");
  save.AddText("FILE", &arguments->file, "File to write").Required();
  save.SetDetails(
      "Runs without a time limit unless --timeout is given. A failed backup leaves no file.");
  save.SetExamples({{"", "hullctl backup save hulls.backup"}});
  OnGiven(save, invocation, arguments, Save);
  Command restore =
      command.AddCommand("restore", "Create a data directory from a backup, for a new hulld");
  restore.AddText("FILE", &arguments->file, "File of 'backup save'").Required();
  restore.AddText("--data-dir", &arguments->data_dir, "Directory to create; must be new or empty")
      .ValueName("DIRECTORY")
      .Completes(ValueKind::kDirectory)
      .Required();
  restore.SetExamples({{"", "hullctl backup restore hulls.backup --data-dir restored"},
                       {"", "hulld --data-dir restored"}});
  OnGiven(restore, invocation, arguments, Restore, /*needs_server=*/false);
}

}  // namespace hulld
