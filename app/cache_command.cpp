/// `seldinger cache`.

#include <chrono>
#include <filesystem>
#include <fmt/chrono.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "engine/anatomy/model_cache.h"
#include "engine/io/error.h"

namespace app {
namespace {

struct CacheArguments {
    std::string folder;
    std::optional<double> keep_MB;
};

std::string megabytes(std::uintmax_t bytes) {
    return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6);
}

int list_cache(const std::filesystem::path& folder) {
    std::uintmax_t sum = 0;
    const std::vector<anatomy::CacheItem> items = anatomy::cache_items(folder);
    for (const anatomy::CacheItem& item : items) {
        const auto used =
            std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::file_clock::to_sys(item.used));
        print("{:%Y-%m-%d %H:%M}  {:>10}  {}\n", fmt::gmtime(std::chrono::system_clock::to_time_t(used)),
              megabytes(item.bytes), item.path.filename().string());
        sum += item.bytes;
    }
    print("{}: {} things, {} of at most {}\n", folder.string(), items.size(), megabytes(sum),
          megabytes(anatomy::cache_limit()));
    return done;
}

int clear_cache(const std::filesystem::path& folder, double keep_MB) {
    std::uintmax_t sum = 0;
    const anatomy::ShrunkCache shrunk =
        anatomy::shrink_cache(folder, static_cast<std::uintmax_t>(1e6 * keep_MB));
    for (const anatomy::CacheItem& item : shrunk.removed) sum += item.bytes;
    print("{}: {} things removed, {}\n", folder.string(), shrunk.removed.size(), megabytes(sum));
    if (shrunk.stuck.empty()) return done;
    throw io::InputError("{}: {} things cannot be removed, {} first: {}", folder.string(),
                         shrunk.stuck.size(), shrunk.stuck.front().path.filename().string(), shrunk.why);
}

}  // namespace

Command add_cache(CLI::App& parser) {
    const auto arguments = std::make_shared<CacheArguments>();
    CLI::App* command = parser.add_subcommand(
        "cache", "Grown vessels, distance fields and prepared CTs: what is kept, and removing it");
    command->require_subcommand(1);
    CLI::App* list = command->add_subcommand("list", "What is kept, what was used last first");
    CLI::App* clear =
        command->add_subcommand("clear", "Removes what is kept; it is made again when it is needed");
    for (CLI::App* each : {list, clear})
        each->add_option(
            "--cache", arguments->folder,
            "The folder; else the room's own. 'run' and others keep theirs in cache beside --out");
    add_optional(clear, "--keep-mb", arguments->keep_MB,
                 "Keeps what was used last, up to so many million bytes")
        ->check(CLI::Range(0.0, 1e9));
    return {command, [arguments, list] {
                const std::filesystem::path folder = usual_cache(arguments->folder);
                std::error_code ignored;
                if (!std::filesystem::is_directory(folder, ignored))
                    throw io::InputError("{}: there is no such cache; expected --cache FOLDER",
                                         folder.string());
                return *list ? list_cache(folder) : clear_cache(folder, arguments->keep_MB.value_or(0));
            }};
}

}  // namespace app
