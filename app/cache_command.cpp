/// `seldinger cache`.

#include <chrono>
#include <filesystem>
#include <fmt/chrono.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/json.h"
#include "engine/anatomy/model_cache.h"
#include "engine/io/error.h"

namespace app {
namespace {

struct CacheArguments {
    std::string folder;
    std::optional<double> keep_MB;
    bool json = false, ct = false;
};

std::string megabytes(std::uintmax_t bytes) {
    return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6);
}

std::tm used(const anatomy::CacheItem& item) {
    const auto time =
        std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::file_clock::to_sys(item.used));
    return fmt::gmtime(std::chrono::system_clock::to_time_t(time));
}

Json of_items(const std::vector<anatomy::CacheItem>& items) {
    Json list = Json::array();
    for (const anatomy::CacheItem& item : items)
        list.push_back({{"name", item.path.filename().string()},
                        {"bytes", item.bytes},
                        {"of_ct", item.of_ct},
                        {"used", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", used(item))}});
    return list;
}

int list_cache(const std::filesystem::path& folder, bool json) {
    std::uintmax_t sum = 0;
    int of_ct = 0;
    const std::vector<anatomy::CacheItem> items = anatomy::cache_items(folder);
    if (json) {
        print_json({{"schema", 1},
                    {"folder", folder.string()},
                    {"limit_bytes", anatomy::cache_limit()},
                    {"items", of_items(items)}});
        return done;
    }
    for (const anatomy::CacheItem& item : items) {
        print("{:%Y-%m-%d %H:%M}  {:>10}  {}{}\n", used(item), megabytes(item.bytes),
              item.path.filename().string(), item.of_ct ? "  of a CT" : "");
        sum += item.bytes;
        of_ct += item.of_ct;
    }
    print("{}: {} things, {} of at most {}{}\n", folder.string(), items.size(), megabytes(sum),
          megabytes(anatomy::cache_limit()),
          of_ct > 0 ? fmt::format("; {} of a CT, which 'clear --ct' removes", of_ct) : "");
    std::error_code ignored;
    using std::filesystem::perms;
    if ((std::filesystem::status(folder, ignored).permissions() & (perms::group_all | perms::others_all)) !=
        perms::none)
        print("Others may enter this folder: 'chmod 700' keeps them out\n");
    return done;
}

int clear_cache(const std::filesystem::path& folder, bool ct, double keep_MB, bool json) {
    std::uintmax_t sum = 0;
    const anatomy::ShrunkCache shrunk =
        ct ? anatomy::remove_of_ct(folder)
           : anatomy::shrink_cache(folder, static_cast<std::uintmax_t>(1e6 * keep_MB));
    for (const anatomy::CacheItem& item : shrunk.removed) sum += item.bytes;
    if (json)
        print_json({{"schema", 1}, {"folder", folder.string()}, {"removed", of_items(shrunk.removed)}});
    else
        print("{}: {} things removed, {}\n", folder.string(), shrunk.removed.size(), megabytes(sum));
    if (shrunk.stuck.empty()) return done;
    throw io::InputError("{}: {} things cannot be removed, {} first: {}", folder.string(),
                         shrunk.stuck.size(), shrunk.stuck.front().path.filename().string(), shrunk.why);
}

}  // namespace

Command add_cache(CLI::App& parser) {
    const auto arguments = std::make_shared<CacheArguments>();
    CLI::App* command = parser.add_subcommand(
        "cache",
        "Grown vessels, distance fields and prepared CTs: what is kept, and removing it\n\n"
        "Examples:\n"
        "  seldinger cache list\n"
        "  seldinger cache clear --keep-mb 500");
    command->require_subcommand(1);
    CLI::App* list = command->add_subcommand("list",
                                             "What is kept, what was used last first\n\n"
                                             "Example:\n"
                                             "  seldinger cache list --json");
    CLI::App* clear = command->add_subcommand("clear",
                                              "Remove what is kept; it is made again when it is needed\n\n"
                                              "Example:\n"
                                              "  seldinger cache clear --keep-mb 500\n"
                                              "  seldinger cache clear --ct");
    for (CLI::App* each : {list, clear}) {
        each->add_option(
                "--cache", arguments->folder,
                "The folder; else the room's own. 'run' and others keep theirs in cache beside --out")
            ->type_name("FOLDER");
        add_json(each, arguments->json);
    }
    add_optional(clear, "--keep-mb", arguments->keep_MB,
                 "Keeps what was used last, up to so many million bytes")
        ->check(number(0, 1e9));
    clear->add_flag("--ct", arguments->ct, "Removes what has voxels of a patient's CT, and nothing else")
        ->excludes("--keep-mb");
    return {command, [arguments, list] {
                const std::filesystem::path folder = usual_cache(arguments->folder);
                std::error_code ignored;
                if (!std::filesystem::is_directory(folder, ignored))
                    throw io::InputError("{}: there is no such cache; --cache FOLDER names another",
                                         folder.string());
                return *list ? list_cache(folder, arguments->json)
                             : clear_cache(folder, arguments->ct, arguments->keep_MB.value_or(0),
                                           arguments->json);
            }};
}

}  // namespace app
