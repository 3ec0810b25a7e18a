/// seldinger-study: the studies, in a program of their own because few users need it and it takes long to
/// build. `seldinger study` starts it.

#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <optional>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "app/study_arguments.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/studies/shards.h"
#include "engine/studies/study.h"

namespace app {
namespace {

int list_studies() {
    for (const studies::Study& known : studies::all_studies()) print("{:<20} {}\n", known.id, known.question);
    print("{:<20} {}\n", "all", "every one of them, and one page of all pictures and claims");
    print("{:<20} {}\n", "merge", "makes one run of the folders that --shard left");
    return 0;
}

int study(const StudyArguments& arguments) {
    const std::string& id = arguments.id;
    if (id.empty()) return list_studies();
    const bool all = id == "all", merge = id == "merge";
    const studies::Study* chosen = all || merge ? nullptr : &studies::find_study(id);
    if (arguments.out.empty()) throw BadArgument("--out FOLDER is missing");
    if (!merge && !arguments.folders.empty())
        throw BadArgument("expected no more arguments after '{}', found '{}'; 'study merge' takes folders",
                          id, arguments.folders.front().string());
    if (arguments.shard && !chosen) throw BadArgument("--shard: expected one study with it, found '{}'", id);
    studies::StudyOptions options;
    const char* meshes = std::getenv("SELDINGER_REAL_MESHES");
    if (meshes) options.real_meshes = meshes;
    options.scenarios = assets() / "scenarios";
    options.devices = assets() / "devices";
    options.pictures = arguments.pictures;
    options.quick = arguments.quick;
    options.threads = arguments.threads;
    options.seed = arguments.seed;
    options.program = program;
    std::vector<std::string> notices;
    {
        ProgressBar bar;
        options.progress = [&bar](const studies::StudyProgress& p) {
            bar.show(static_cast<double>(p.done) / p.of, fmt::format("{}/{}  {}", p.done, p.of, p.what));
        };
        if (all)
            notices = studies::run_all_studies(arguments.out, options);
        else if (merge)
            notices = studies::merge_shards(arguments.folders, arguments.out, options);
        else if (arguments.shard)
            studies::run_shard(*chosen, io::parse_shard(*arguments.shard), arguments.out, options);
        else
            notices = studies::run_study(*chosen, arguments.out, options);
    }
    for (const std::string& notice : notices) tell("note: {}\n", notice);
    if (arguments.shard)
        print("{}: shard {} in {}/shard.json\n", id, *arguments.shard, arguments.out);
    else
        print("{}: tables and pictures in {}, to be read from {}\n", id, arguments.out,
              all     ? "index.html"
              : merge ? "the page there"
                      : id + ".md");
    return 0;
}

}  // namespace
}  // namespace app

int main(int count, char** values) {
    app::catch_signals();
    CLI::App parser(app::study_description, "seldinger study");
    app::StudyArguments arguments;
    app::add_study_arguments(parser, arguments);
    return app::run_action(parser, count, values, [&] { return app::study(arguments); });
}
