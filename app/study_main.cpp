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
#include "engine/io/error.h"
#include "engine/io/shard.h"
#include "engine/studies/shards.h"
#include "engine/studies/study.h"

namespace app {
namespace {

struct StudyArguments {
    std::string id, out;
    std::vector<std::filesystem::path> folders;  // of shards to merge
    std::optional<std::string> shard;
    bool quick = false;
    int threads = 2;
    std::uint64_t seed = 1;
};

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
    if (arguments.out.empty()) throw io::InputError("study {}: --out is missing; expected a folder", id);
    if (!merge && !arguments.folders.empty())
        throw io::InputError("study {}: '{}' was found; folders go with 'study merge'", id,
                             arguments.folders.front().string());
    if (arguments.shard && !chosen)
        throw io::InputError("--shard: 'study {}' cannot be cut; it goes with one study", id);
    studies::StudyOptions options;
    const char* meshes = std::getenv("SELDINGER_REAL_MESHES");
    if (meshes) options.real_meshes = meshes;
    options.scenarios = assets() / "scenarios";
    options.devices = assets() / "devices";
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
    CLI::App parser("Run a study, or without an ID list them", "seldinger study");
    parser.set_version_flag("--version", app::program);
    app::StudyArguments arguments;
    parser.add_option("id", arguments.id, "Which study, or 'all', or 'merge'");
    parser.add_option("folders", arguments.folders, "Of 'merge': those that --shard left");
    parser.add_option("--out", arguments.out, "Folder for tables and pictures");
    parser.add_flag("--quick", arguments.quick, "Shorter wires, less work: a try, not a result");
    parser.add_option("--threads", arguments.threads, "Threads; results do not depend on them")
        ->check(CLI::Range(1, 256));
    app::add_optional(&parser, "--shard", arguments.shard,
                      "i/n: the i-th of n equal parts, for 'merge' (wall-variation)");
    parser.add_option("--seed", arguments.seed, "Of a study that draws random numbers")
        ->check(CLI::Range(0.0, 9e15));

    parser.footer(
        "Examples:\n"
        "  seldinger study                                     the studies and their questions\n"
        "  seldinger study accuracy --quick --out study        one of them, as a try\n"
        "  seldinger study all --out studies                   all, on one page\n"
        "Exit codes: 0 done, 2 bad input, 130 interrupted.");
    return app::run_action(parser, count, values, [&] { return app::study(arguments); });
}
