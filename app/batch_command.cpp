/// `seldinger batch`: many runs from one list.

#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/batch.h"

namespace app {
namespace {

struct BatchArguments {
    std::string list, out, cache;
    std::vector<std::string> exercises;
    std::vector<std::filesystem::path> folders;  // of shards to merge
    std::optional<std::string> shard;
    int jobs = 2;
};

int merge(const BatchArguments& arguments) {
    if (arguments.shard)
        throw BadArgument("--shard: expected it with a list, found it with 'merge', which takes all shards");
    run::BatchOptions options;
    options.interrupted = stop_requested;
    run::BatchResult result;
    {
        ProgressBar bar;
        options.progress = [&bar](std::size_t finished, std::size_t of, std::size_t) {
            bar.show(static_cast<double>(finished) / static_cast<double>(of),
                     fmt::format("run {} of {}", finished, of));
        };
        result = run::merge_batch(arguments.folders, arguments.out, options);
    }
    if (result.interrupted) {
        tell("interrupted: the same command begins again\n");
        return interrupted;
    }
    print("{} runs of {} shards{}: {}/batch.csv\n", result.runs, arguments.folders.size(),
          result.failed > 0 ? fmt::format(", {} failed", result.failed) : "", arguments.out);
    return result.failed > 0 ? not_reached : done;
}

int batch(const BatchArguments& arguments) {
    if (arguments.list == "merge") return merge(arguments);
    if (!arguments.folders.empty())
        throw BadArgument("expected no more arguments after a list, found '{}'; 'batch merge' takes folders",
                          arguments.folders.front().string());
    run::BatchOptions options;
    if (arguments.shard) options.shard = io::parse_shard(*arguments.shard);
    const scenario::ExerciseFolders folders = exercise_folders(arguments.exercises);
    options.exercise = [&](const std::string& name, const std::filesystem::path& beside) {
        const std::filesystem::path own = beside / name;
        io::require_no_device(own);
        if (std::filesystem::is_regular_file(own)) return folders.of(own);
        return exercise_named({name, arguments.exercises});
    };
    options.devices = catalogue();
    options.list = arguments.list;
    options.origin = origin();
    options.cache.folder = arguments.cache;
    options.jobs = arguments.jobs;
    options.interrupted = stop_requested;
    const std::vector<run::BatchJob> jobs = run::load_batch(arguments.list, options);
    run::BatchResult result;
    {
        ProgressBar bar;
        options.progress = [&bar](std::size_t finished, std::size_t of, std::size_t failed) {
            bar.show(static_cast<double>(finished) / static_cast<double>(of),
                     fmt::format("run {} of {}{}", finished, of,
                                 failed > 0 ? fmt::format(", {} failed", failed) : ""));
        };
        result = run::run_batch(jobs, arguments.out, options);
    }
    print("{} of {} runs{}{}: {}/batch.csv\n", result.runs, result.of,
          result.skipped > 0 ? fmt::format(", {} of them made before", result.skipped) : "",
          result.failed > 0 ? fmt::format(", {} failed", result.failed) : "", arguments.out);
    if (result.interrupted) {
        tell("interrupted: the same command goes on\n");
        return interrupted;
    }
    return result.failed > 0 ? not_reached : done;
}

}  // namespace

Command add_batch(CLI::App& parser) {
    const auto arguments = std::make_shared<BatchArguments>();
    CLI::App* command = parser.add_subcommand(
        "batch",
        "Many runs from a list: scenarios, scripts, seeds and values of any key, in parallel\n\n"
        "Examples:\n"
        "  seldinger batch runs.toml --out runs --jobs 4\n"
        "  seldinger batch runs.toml --shard 1/2 --out a");
    command->add_option("list", arguments->list, "The list (.toml), as below; or 'merge'")
        ->required()
        ->type_name("FILE");
    command->add_option("folders", arguments->folders, "Of 'merge': those of all shards of a list")
        ->type_name("FOLDER");
    command->add_option("--out", arguments->out, "Folder for a folder of each run, and batch.csv")
        ->required()
        ->type_name("FOLDER");
    add_exercises(command, arguments->exercises);
    command->add_option("--jobs", arguments->jobs, "Runs at the same time; results do not depend on it")
        ->check(whole_number(1, 256));
    add_optional(command, "--shard", arguments->shard,
                 "i/n: only the i-th of n shares of the list, for another machine and 'merge'")
        ->type_name("i/n")
        ->check(shard());
    add_cache_folder(command, arguments->cache, "cache beside --out");
    command->footer(
        "A list:\n"
        "  schema = 1\n"
        "  [[run]]\n"
        "  scenario = [\"renal\", \"my.toml\"]        # exercises, or files beside the list\n"
        "  commands = \"solution\"                  # that of the exercise, or files\n"
        "  seeds = [1, 2, 3]                      # of the images' noise\n"
        "  images = false\n"
        "  [run.set]                              # every combination\n"
        "  \"guidewire.friction\" = [0.0, 0.1]\n"
        "Over machines: --shard 1/2 --out a here, --shard 2/2 --out b there, then\n"
        "  seldinger batch merge a b --out all    # the files of one machine's batch, byte for byte\n"
        "Exit codes: 0 all runs were made, 1 some failed (their rows say why), 2 bad input, 130 "
        "interrupted.");
    return {command, [arguments] { return batch(*arguments); }};
}

}  // namespace app
