/// `seldinger course`: a folder of recordings as a teacher sees it.

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "app/signature.h"
#include "engine/debrief/course_page.h"
#include "engine/debrief/page.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/script/recording.h"

namespace app {
namespace {

struct CourseArguments {
    std::string folder, out, cache, plan, key;
    std::vector<std::string> exercises;
    int jobs = 2;
    bool debrief = false, no_pictures = false, json = false;
};

using debrief::CourseRow;
namespace fs = std::filesystem;

/// The file's that is named, or is in the folder; else the curriculum of all exercises that are found.
debrief::CoursePlan plan_of(const CourseArguments& arguments, const scenario::ExerciseFolders& folders) {
    std::vector<scenario::Scenario> curriculum;
    for (LoadedExercise& exercise : loaded(folders.all())) curriculum.push_back(std::move(exercise.scenario));
    const debrief::CoursePlan usual = debrief::usual_plan(curriculum);
    const fs::path in_folder = fs::path(arguments.folder) / debrief::course_file;
    std::error_code ignored;
    if (arguments.plan.empty() && !fs::exists(in_folder, ignored)) return usual;
    const fs::path file = arguments.plan.empty() ? in_folder : fs::path(arguments.plan);
    const debrief::FindScenario find = [&folders](const std::string& name) {
        if (!scenario::is_exercise_name(name))
            throw io::InputError("expected an exercise's name of letters, digits, '-' and '_', found '{}'",
                                 name);
        return load_exercise(folders.find(name).file);
    };
    return debrief::parse_plan(io::read_text(file, "course", "expected a file named course.toml"),
                               file.string(), find, usual);
}

/// Recordings that count, by learner and exercise, in order.
std::map<std::pair<std::string, std::string>, std::vector<fs::path>> counted(
    const std::vector<CourseRow>& rows) {
    std::map<std::pair<std::string, std::string>, std::vector<fs::path>> files;
    for (const CourseRow& row : rows) {
        if (!row.problem.empty()) continue;
        std::vector<fs::path>& of = files[{row.learner, row.exercise}];
        if (of.empty() || of.back() != row.file) of.emplace_back(row.file);
    }
    return files;
}

/// Makes the pages that are missing, each with the learning curve of the attempts before. False: interrupted.
bool make_debriefings(const CourseArguments& arguments, const fs::path& out,
                      const std::vector<CourseRow>& rows, const debrief::CourseOptions& course) {
    const auto groups = counted(rows);
    std::size_t all = 0, number = 0;
    for (const auto& [key, files] : groups) all += files.size();
    debrief::StoryOptions options;
    options.cache = course.cache;
    options.interrupted = stop_requested;
    ProgressBar bar;
    options.progress = [&](double part, const char* what) {
        bar.show((static_cast<double>(number) + part) / static_cast<double>(all),
                 fmt::format("debriefing {} of {}: {}", number + 1, all, what));
    };
    for (const auto& [key, files] : groups) {
        std::vector<debrief::Story> stories;
        const auto is_missing = [&](const fs::path& file) {
            std::error_code ignored;
            return !fs::exists(debrief::debriefing_page(file, arguments.folder, out), ignored);
        };
        const auto last = std::find_if(files.rbegin(), files.rend(), is_missing).base();
        for (auto file = files.begin(); file != files.end(); ++file, ++number) {
            if (file >= last) continue;
            const bool missing = is_missing(*file);
            options.images = missing && !arguments.no_pictures;
            const script::CommandScript recording = script::load_commands(*file);
            auto story = debrief::tell(course.scenario(recording), recording, options);
            if (!story) return false;
            stories.push_back(std::move(*story));
            if (missing) {
                const fs::path page = debrief::debriefing_page(*file, arguments.folder, out);
                io::make_folder(page.parent_path());
                io::write_whole(page, debrief::page(stories, nullptr));
            }
            stories.back().moments.clear();  // only the last one's are on a page
            stories.back().key_frames.clear();
        }
    }
    return true;
}

/// Says for each attempt where its page is, if it is anywhere. Returns how many recordings have none.
std::size_t link_debriefings(std::vector<CourseRow>& rows, const fs::path& folder, const fs::path& out) {
    std::set<std::string> without;
    for (CourseRow& row : rows) {
        if (!row.problem.empty()) continue;
        const fs::path page = debrief::debriefing_page(row.file, folder, out);
        std::error_code ignored;
        if (fs::is_regular_file(page, ignored))
            row.debriefing = debrief::link_to(page, out);
        else
            without.insert(row.file);
    }
    return without.size();
}

int course(const CourseArguments& arguments) {
    const fs::path folder = arguments.folder;
    const fs::path out = arguments.out.empty() ? folder : fs::path(arguments.out);
    std::error_code none;
    if (!fs::is_directory(folder, none))
        throw io::InputError("{}: expected a folder with recordings (.gw), found none", folder.string());
    if (arguments.no_pictures && !arguments.debrief)
        throw BadArgument("--no-pictures: expected --debrief with it, found none");
    const std::vector<fs::path> files = script::recordings_of(folder);
    const scenario::ExerciseFolders folders = exercise_folders(arguments.exercises);
    std::vector<fs::path> inputs = folders.files();
    inputs.insert(inputs.end(), files.begin(), files.end());
    inputs.emplace_back(arguments.plan);
    inputs.emplace_back(arguments.key);
    std::vector<io::Output> outputs;
    for (const char* name : {"course.csv", "course.html"}) outputs.push_back({"--out", out / name});
    io::require_distinct(outputs, inputs);
    debrief::CourseOptions options;
    options.scenario = [&](const script::CommandScript& recording) {
        return load_exercise(folders.of_recording(recording, catalogue()).file, {},
                             recording.origin->patient);
    };
    if (!arguments.key.empty())
        options.distrust = [key = PublicKey(arguments.key)](std::string_view text) {
            return key.distrust(text);
        };
    const debrief::CoursePlan plan = plan_of(arguments, folders);
    const io::OwnFolder own(out);
    for (const char* name : {"course.csv", "course.html"}) io::require_writable(out / name);
    options.cache.folder = usual_cache(arguments.cache);
    options.program_hash = io::hash_text(origin().program_hash);
    options.jobs = arguments.jobs;
    options.interrupted = stop_requested;
    std::optional<std::vector<CourseRow>> rows;
    {
        ProgressBar bar;
        options.progress = [&bar](std::size_t done, std::size_t of) {
            bar.show(static_cast<double>(done) / static_cast<double>(of),
                     fmt::format("recording {} of {}", done, of));
        };
        rows = debrief::course_of(files, options);
    }
    if (!rows || (arguments.debrief && !make_debriefings(arguments, out, *rows, options))) {
        tell("interrupted: what was computed is kept, the same command goes on\n");
        return interrupted;
    }
    const std::size_t without = link_debriefings(*rows, folder, out);
    const std::string usual_title =
        fs::absolute(folder / "").lexically_normal().parent_path().filename().string();
    const std::string csv = debrief::course_csv(*rows, plan),
                      page = debrief::course_page(*rows, plan, plan.title.empty() ? usual_title : plan.title,
                                                  debrief::day_of(std::chrono::system_clock::now()));
    io::write_whole({{out / "course.csv", csv}, {out / "course.html", page}});
    std::size_t bad = 0;
    for (const CourseRow& row : *rows) bad += !row.problem.empty();
    if (arguments.json) {
        write_out(debrief::course_json(*rows, plan));
        return done;
    }
    for (const CourseRow& row : *rows)
        if (!row.problem.empty()) tell("note: {} does not count: {}\n", row.file, row.problem);
    print("{} recordings, {} attempts{}: {} and course.csv\n", files.size(), rows->size() - bad,
          bad > 0 ? fmt::format(", {} files that do not count", bad) : "", (out / "course.html").string());
    if (without > 0) print("{} recordings have no debriefing: --debrief makes them\n", without);
    return done;
}

}  // namespace

Command add_course(CLI::App& parser) {
    const auto arguments = std::make_shared<CourseArguments>();
    CLI::App* command =
        parser.add_subcommand("course",
                              "A folder of recordings: who has passed what, who needs what, errors\n\n"
                              "Examples:\n"
                              "  seldinger course recordings\n"
                              "  seldinger course recordings --debrief --out course");
    command->add_option("folder", arguments->folder, "Folder with recordings (.gw), also in folders below")
        ->required()
        ->type_name("FOLDER");
    command
        ->add_option("--out", arguments->out, "Folder for course.html and course.csv; else the same folder")
        ->type_name("FOLDER");
    command
        ->add_option(
            "--course", arguments->plan,
            "The course's exercises, pass marks, dates and learners; else course.toml in the folder, "
            "else every exercise with a level (docs/course.md)")
        ->type_name("FILE");
    command->add_flag(
        "--debrief", arguments->debrief,
        "Make the debriefings that are missing: beside the recordings, with --out at the same place there");
    command->add_flag("--no-pictures", arguments->no_pictures,
                      "Debriefings without key frames, in less time");
    add_key(command, arguments->key, "an attempt without a valid signature does not count");
    add_exercises(command, arguments->exercises, "--exercises,--scenarios");
    command->add_option("--jobs", arguments->jobs, "Recordings that are played at the same time")
        ->check(whole_number(1, 256));
    add_cache_folder(command, arguments->cache);
    command->add_flag("--json", arguments->json,
                      "Every attempt as JSON for programs, to standard output as well (docs/json.md)");
    command->footer("Exit codes: 0 done, 2 bad input, 130 interrupted.");
    return {command, [arguments] { return course(*arguments); }};
}

}  // namespace app
