/// `seldinger debrief`: a page about one learner's attempts at one exercise.

#include <fmt/format.h>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/debrief/page.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"
#include "engine/script/recording.h"

namespace app {
namespace {

struct DebriefArguments {
    std::vector<std::string> files;
    ScenarioChoice scenario;
    std::string expert, out, cache;
    bool force = false, no_pictures = false;
};

/// What one page is about: a learner's attempts at one exercise.
struct Page {
    std::filesystem::path file;
    scenario::Scenario scenario;
    std::vector<script::CommandScript> recordings;
};

/// The recordings that are named, on one page.
Page one_page(const DebriefArguments& arguments) {
    Page page{std::filesystem::path(arguments.out) / "debrief.html", {}, {}};
    for (const std::string& name : arguments.files) page.recordings.push_back(script::load_commands(name));
    page.scenario = scenario_of(page.recordings.front(), arguments.scenario);
    for (const script::CommandScript& recording : page.recordings)
        if (recording.origin && !recording.origin->scenario.empty() &&
            recording.origin->scenario != page.scenario.name && !arguments.force)
            throw io::InputError(
                "{}: expected a recording of '{}', as the others on this page are, found one of '{}'",
                recording.file, page.scenario.name, recording.origin->scenario);
    return page;
}

/// The recordings of a folder: a page for each learner and exercise. Scripts and free practice, which are no
/// attempts, are told and left out.
std::vector<Page> pages_of(const std::filesystem::path& folder, const DebriefArguments& arguments) {
    std::map<std::pair<std::string, std::string>, std::vector<script::CommandScript>> groups;
    std::set<std::string> learners;
    for (const std::filesystem::path& file : script::recordings_of(folder)) {
        script::CommandScript recording;
        std::string why;
        try {
            recording = script::load_commands(file);
            if (!recording.origin || recording.origin->scenario.empty())
                why = "a script, and no recording";
            else if (recording.origin->free_practice)
                why = "free practice, and no attempt";
        } catch (const io::InputError& error) {
            why = error.what();
        }
        if (!why.empty()) {
            tell("note: {} is left out: {}\n", file.string(), why);
            continue;
        }
        learners.insert(recording.origin->learner);
        const script::Origin& origin = *recording.origin;
        const std::string patient = origin.patient.empty() ? "" : "-patient-" + origin.patient;
        groups[{origin.learner, origin.scenario + patient}].push_back(std::move(recording));
    }
    if (groups.empty())
        throw io::InputError("{}: expected recordings of attempts, found none", folder.string());
    std::vector<Page> pages;
    for (auto& [key, recordings] : groups) {
        const auto& [learner, exercise] = key;
        std::string name = "debrief";
        if (learners.size() > 1) name += "-" + io::file_name_of(learner.empty() ? "guest" : learner);
        if (groups.size() > 1) name += "-" + io::file_name_of(exercise);
        try {
            scenario::Scenario scenario = scenario_of(recordings.front(), arguments.scenario);
            pages.push_back({std::filesystem::path(arguments.out) / (name + ".html"), std::move(scenario),
                             std::move(recordings)});
        } catch (const io::InputError& error) {
            if (groups.size() == 1) throw;
            tell("note: '{}' is left out: {}\n", exercise, error.what());
        }
    }
    if (pages.empty())
        throw io::InputError("{}: expected recordings of exercises that are found, found none",
                             folder.string());
    return pages;
}

int debrief(DebriefArguments arguments) {
    std::error_code ignored;
    const bool of_folder =
        arguments.files.size() == 1 && std::filesystem::is_directory(arguments.files.front(), ignored);
    if (arguments.out.empty()) {
        if (!of_folder)
            throw BadArgument(
                "--out FOLDER is missing; only for a folder of recordings, which then takes the pages, it "
                "can be "
                "left out");
        arguments.out = arguments.files.front();
    }
    const std::filesystem::path folder = arguments.out;
    const std::vector<Page> pages =
        of_folder ? pages_of(arguments.files.front(), arguments) : std::vector<Page>{one_page(arguments)};
    std::optional<script::CommandScript> experts;
    if (!arguments.expert.empty()) experts = script::load_commands(arguments.expert);
    std::size_t count = 0;
    for (const Page& page : pages) {
        std::vector<std::filesystem::path> inputs;
        for (const script::CommandScript& recording : page.recordings) inputs.emplace_back(recording.file);
        inputs.emplace_back(arguments.expert);
        require_no_input({{"--out", page.file}}, page.scenario, std::move(inputs));
        for (const script::CommandScript& recording : page.recordings) run::check(page.scenario, recording);
        if (experts) run::check(page.scenario, *experts);
        count += page.recordings.size() + experts.has_value();
    }
    const io::OwnFolder own(folder);
    for (const Page& page : pages) io::require_writable(page.file);
    debrief::StoryOptions options;
    options.cache.folder = usual_cache(arguments.cache);
    options.same_origin = !arguments.force;
    options.interrupted = stop_requested;
    std::vector<std::pair<const Page*, std::string>> made;
    std::vector<std::string> differences;
    {
        ProgressBar bar;
        report_on(bar, options.cache);
        std::size_t number = 0;
        options.progress = [&](double part, const char* what) {
            bar.show((static_cast<double>(number) + part) / static_cast<double>(count),
                     fmt::format("{} of {}: {}", number + 1, count, what));
        };
        for (const Page& page : pages) {
            std::vector<debrief::Story> stories;
            std::optional<debrief::Story> expert;
            for (const script::CommandScript& recording : page.recordings) {
                options.images = &recording == &page.recordings.back() && !arguments.no_pictures;
                options.same_origin = !arguments.force;
                std::optional<debrief::Story> story = debrief::tell(page.scenario, recording, options);
                if (!story) return interrupted;
                for (const std::string& difference : story->differences)
                    differences.push_back(fmt::format("{}: {}", story->file, difference));
                stories.push_back(std::move(*story));
                ++number;
            }
            if (experts) {
                options.images = options.same_origin = false;
                expert = debrief::tell(page.scenario, *experts, options);
                if (!expert) return interrupted;
                ++number;
            }
            made.emplace_back(&page, debrief::page(stories, expert ? &*expert : nullptr));
        }
    }
    for (const auto& [page, text] : made) io::write_whole(page->file, text);
    for (const std::string& difference : differences) tell("{}\n", difference);
    for (const Page& page : pages) print("{}: open it in a browser\n", page.file.string());
    return done;
}

}  // namespace

Command add_debrief(CLI::App& parser) {
    const auto arguments = std::make_shared<DebriefArguments>();
    CLI::App* command = parser.add_subcommand(
        "debrief",
        "A page about attempts at an exercise: grade, time line, errors, learning curve\n\n"
        "Examples:\n"
        "  seldinger debrief hello/run.gw --out debrief\n"
        "  seldinger debrief recordings --expert skilled.gw");
    command
        ->add_option("files", arguments->files,
                     "Recordings (.gw) of one exercise, in order; the page is about the last. Or a folder of "
                     "recordings: a page for each learner and exercise")
        ->required()
        ->type_name("FILE");
    command
        ->add_option("--out", arguments->out,
                     "Folder for debrief.html; for a folder of recordings else that folder")
        ->type_name("FOLDER");
    command->add_option("--expert", arguments->expert, "Recording, or script, to compare with")
        ->type_name("FILE");
    add_scenario_of_recording(command, arguments->scenario);
    command->add_flag("--no-pictures", arguments->no_pictures, "Without key frames, which takes less time");
    command->add_flag("--force", arguments->force,
                      "Go on where scenario or anatomy have changed since they were recorded");
    add_cache_folder(command, arguments->cache);
    command->footer("Exit codes: 0 done, 2 bad input, 130 interrupted.");
    return {command, [arguments] { return debrief(*arguments); }};
}

}  // namespace app
