/// `seldinger course`: a folder of recordings as a teacher sees it.

#include <fmt/format.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/debrief/course.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/outputs.h"
#include "engine/io/text.h"
#include "engine/script/recording.h"

namespace app {
namespace {

struct CourseArguments {
    std::string folder, out, cache;
    std::vector<std::string> exercises;
    int jobs = 2;
};

int course(const CourseArguments& arguments) {
    const std::filesystem::path folder = arguments.folder;
    const std::filesystem::path out = arguments.out.empty() ? folder : std::filesystem::path(arguments.out);
    std::error_code none;
    if (!std::filesystem::is_directory(folder, none))
        throw io::InputError("{}: no such folder; one with recordings (.gw) is accepted", folder.string());
    const std::vector<std::filesystem::path> files = script::recordings_of(folder);
    const scenario::ExerciseFolders folders = exercise_folders(arguments.exercises);
    std::vector<std::filesystem::path> inputs = folders.files();
    inputs.insert(inputs.end(), files.begin(), files.end());
    std::vector<io::Output> outputs;
    for (const char* name : {"course.csv", "course.html"}) outputs.push_back({"--out", out / name});
    io::require_distinct(outputs, inputs);
    const io::OwnFolder own(out);
    for (const char* name : {"course.csv", "course.html"}) io::require_writable(out / name);
    debrief::CourseOptions options;
    options.scenario = [&](const script::CommandScript& recording) {
        return load_exercise(folders.of_recording(recording, catalogue()).file);
    };
    options.cache.folder = usual_cache(arguments.cache);
    options.program_hash = io::hash_text(origin().program_hash);
    options.jobs = arguments.jobs;
    options.interrupted = stop_requested;
    std::optional<std::vector<debrief::CourseRow>> rows;
    {
        ProgressBar bar;
        options.progress = [&bar](std::size_t done, std::size_t of) {
            bar.show(static_cast<double>(done) / static_cast<double>(of),
                     fmt::format("recording {} of {}", done, of));
        };
        rows = debrief::course_of(files, options);
    }
    if (!rows) {
        tell("interrupted: what was computed is kept, the same command goes on\n");
        return interrupted;
    }
    const std::string csv = debrief::course_csv(*rows),
                      page = debrief::course_page(*rows, folder.filename().string());
    io::write_whole({{out / "course.csv", csv}, {out / "course.html", page}});
    std::size_t bad = 0;
    for (const debrief::CourseRow& row : *rows) bad += !row.problem.empty();
    print("{} recordings, {} attempts{}: {} and course.csv\n", files.size(), rows->size() - bad,
          bad > 0 ? fmt::format(", {} files that do not count", bad) : "", (out / "course.html").string());
    return done;
}

}  // namespace

Command add_course(CLI::App& parser) {
    const auto arguments = std::make_shared<CourseArguments>();
    CLI::App* command =
        parser.add_subcommand("course", "A folder of recordings: learners, exercises, best and last, errors");
    command->add_option("folder", arguments->folder, "Folder with recordings (.gw), also in folders below")
        ->required();
    command->add_option("--out", arguments->out,
                        "Folder for course.html and course.csv; else the same folder");
    add_exercises(command, arguments->exercises, "--exercises,--scenarios");
    command->add_option("--jobs", arguments->jobs, "Recordings that are played at the same time")
        ->check(CLI::Range(1, 256));
    command->add_option("--cache", arguments->cache,
                        "Folder that keeps grown vessels, fields and figures; else the user's");
    return {command, [arguments] { return course(*arguments); }};
}

}  // namespace app
