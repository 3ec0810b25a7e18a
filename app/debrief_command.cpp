/// `seldinger debrief`: a page about one learner's attempts at one exercise.

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/debrief/page.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"

namespace app {
namespace {

struct DebriefArguments {
    std::vector<std::string> files;
    std::string scenario, expert, out, cache;
    bool force = false, no_pictures = false;
};

int debrief(const DebriefArguments& arguments) {
    const std::filesystem::path folder = arguments.out, file = folder / "debrief.html";
    std::vector<script::CommandScript> recordings;
    for (const std::string& name : arguments.files) recordings.push_back(script::load_commands(name));
    std::optional<script::CommandScript> experts;
    if (!arguments.expert.empty()) experts = script::load_commands(arguments.expert);
    const scenario::Scenario scenario = scenario_of(recordings.front(), arguments.scenario);
    for (const script::CommandScript& recording : recordings)
        if (recording.origin && !recording.origin->scenario.empty() &&
            recording.origin->scenario != scenario.name && !arguments.force)
            throw io::InputError(
                fmt::format("{}: it is a recording of '{}'; recordings of one exercise, '{}', are "
                            "accepted on one page",
                            recording.file, recording.origin->scenario, scenario.name));
    std::vector<std::filesystem::path> inputs(arguments.files.begin(), arguments.files.end());
    inputs.emplace_back(arguments.expert);
    require_no_input({{"--out", file}}, scenario, std::move(inputs));
    for (const script::CommandScript& recording : recordings) run::check(scenario, recording);
    if (experts) run::check(scenario, *experts);
    const io::OwnFolder own(folder);
    io::require_writable(file);
    debrief::StoryOptions options;
    options.cache.folder = usual_cache(arguments.cache);
    options.same_origin = !arguments.force;
    options.interrupted = stop_requested;
    std::vector<debrief::Story> stories;
    std::optional<debrief::Story> expert;
    {
        ProgressBar bar;
        report_on(bar, options.cache);
        std::size_t number = 0;
        const std::size_t of = recordings.size() + experts.has_value();
        options.progress = [&](double part, const char* what) {
            bar.show((static_cast<double>(number) + part) / static_cast<double>(of),
                     fmt::format("{} of {}: {}", number + 1, of, what));
        };
        for (const script::CommandScript& recording : recordings) {
            options.images = &recording == &recordings.back() && !arguments.no_pictures;
            std::optional<debrief::Story> story = debrief::tell(scenario, recording, options);
            if (!story) return interrupted;
            stories.push_back(std::move(*story));
            ++number;
        }
        if (experts) {
            options.images = options.same_origin = false;
            expert = debrief::tell(scenario, *experts, options);
            if (!expert) return interrupted;
        }
    }
    io::write_whole(file, debrief::page(stories, expert ? &*expert : nullptr));
    for (const debrief::Story& story : stories)
        for (const std::string& difference : story.differences) tell("{}: {}\n", story.file, difference);
    fmt::print("{}: open it in a browser\n", file.string());
    return done;
}

}  // namespace

Command add_debrief(CLI::App& parser) {
    const auto arguments = std::make_shared<DebriefArguments>();
    CLI::App* command = parser.add_subcommand(
        "debrief", "A page about attempts at an exercise: grade, time line, errors, learning curve");
    command
        ->add_option("files", arguments->files,
                     "Recordings (.gw) of one exercise, in order; the page is about the last")
        ->required();
    command->add_option("--out", arguments->out, "Folder for debrief.html")->required();
    command->add_option("--expert", arguments->expert, "Recording, or script, to compare with");
    command->add_option("--scenario", arguments->scenario,
                        "The scenario they were recorded in, where that does not ship: a file (.toml)");
    command->add_flag("--no-pictures", arguments->no_pictures, "Without key frames, which takes less time");
    command->add_flag("--force", arguments->force,
                      "Go on where scenario or anatomy have changed since they were recorded");
    command->add_option("--cache", arguments->cache,
                        "Folder that keeps grown vessels and distance fields; else the user's");
    return {command, [arguments] { return debrief(*arguments); }};
}

}  // namespace app
