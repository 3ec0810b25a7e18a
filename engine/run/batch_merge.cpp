#include <fmt/format.h>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/batch.h"
#include "engine/run/batch_rows.h"

namespace run {
namespace {

namespace fs = std::filesystem;

/// Puts the folder at the other place, too: by links to the same files where the file system has them.
void put_beside(const fs::path& from, const fs::path& to) {
    try {
        fs::remove_all(to);  // of a merge that was ended
        try {
            fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::create_hard_links);
        } catch (const fs::filesystem_error&) {
            fs::remove_all(to);
            fs::copy(from, to, fs::copy_options::recursive);
        }
    } catch (const fs::filesystem_error& error) {
        throw io::InputError("{}: {} cannot be put there: {}", to.string(), from.string(),
                             error.code().message());
    }
}

struct ShardFolder {
    fs::path folder;
    std::map<int, BatchRow> rows;
};

}  // namespace

BatchResult merge_batch(std::span<const fs::path> folders, const fs::path& out, const BatchOptions& options) {
    if (folders.empty())
        throw io::InputError("batch merge: no folder was given; expected those of all shards of a list");
    std::vector<std::optional<ShardFolder>> shards;
    BatchShare first;
    for (const fs::path& folder : folders) {
        const BatchShare share = read_share(folder);
        if (shards.empty()) {
            first = share;
            shards.resize(static_cast<std::size_t>(share.shard.count));
        }
        if (share.list != first.list || share.shard.count != first.shard.count || share.runs != first.runs)
            throw io::InputError(
                "{}: a shard of another list, or made by another build of the program, than {}; expected "
                "shards of one batch",
                folder.string(), folders.front().string());
        std::optional<ShardFolder>& place = shards[static_cast<std::size_t>(share.shard.index) - 1];
        if (place)
            throw io::InputError("{}: shard {}/{} was found in {} already", folder.string(),
                                 share.shard.index, share.shard.count, place->folder.string());
        place = ShardFolder{folder, kept_rows(folder / "batch.json")};
    }
    std::map<int, BatchRow> rows;
    std::vector<std::pair<fs::path, std::string>> made;
    for (int number = 1; number <= static_cast<int>(first.runs); ++number) {
        const int index = (number - 1) % first.shard.count + 1;
        const std::optional<ShardFolder>& shard = shards[static_cast<std::size_t>(index) - 1];
        const std::string name = fmt::format("shard {}/{}", index, first.shard.count);
        if (!shard) throw io::InputError("{} is missing", name);
        const auto row = shard->rows.find(number);
        const std::string folder = run_folder(number);
        if (row == shard->rows.end() ||
            (!row->second.failed && !fs::exists(shard->folder / folder / "score.json")))
            throw io::InputError("{}: run {} is missing; {} is to be made to its end first",
                                 shard->folder.string(), number, name);
        rows[number] = row->second;
        if (fs::exists(shard->folder / folder)) made.emplace_back(shard->folder / folder, folder);
    }
    std::error_code ignored;
    if (fs::exists(out / "batch.json", ignored))
        throw io::InputError("{}: runs were found there; expected a new folder", out.string());
    std::vector<std::unique_ptr<io::OwnFolder>> owned;  // a shard that is being made is refused
    for (const std::optional<ShardFolder>& shard : shards)
        owned.push_back(std::make_unique<io::OwnFolder>(shard->folder));
    owned.push_back(std::make_unique<io::OwnFolder>(out));
    BatchResult result;
    result.of = rows.size();
    for (std::size_t k = 0; k < made.size(); ++k) {
        if (options.interrupted && options.interrupted()) {
            result.interrupted = true;
            return result;  // the same call puts everything there again
        }
        put_beside(made[k].first, out / made[k].second);
        if (options.progress) options.progress(k + 1, made.size(), 0);
    }
    write_rows(rows, out);
    result.runs = rows.size();
    for (const auto& [number, row] : rows) result.failed += row.failed;
    return result;
}

}  // namespace run
