#include "engine/run/batch_rows.h"

#include <fmt/format.h>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <variant>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/batch.h"

namespace run {
namespace {

namespace fs = std::filesystem;
using BatchJson = nlohmann::json;

const char* const header =
    "run,scenario,commands,values,reached,completion_time_s,beam_on_time_s,contrast_ml,wire_travel_mm,"
    "tip_to_target_mm,peak_wall_force_N,wrong_entries,handling_errors,dissections,"
    "perforations,residual_percent,lumen_mm,gradient_mmHg,stent_covered_percent,missed_proximal_mm,"
    "missed_distal_mm,proximal_off_plan_mm,distal_off_plan_mm,balloon_to_artery,inflations,bursts,"
    "balloon_dissections,balloon_dissections_left,ruptures,"
    "frames,state_hash,problem\n";

namespace fs = std::filesystem;

struct ShardFolder {
    fs::path folder;
    std::map<int, BatchRow> rows;
};

}  // namespace

std::string run_folder(int number) {
    return fmt::format("{:06}", number);
}

std::map<int, BatchRow> kept_rows(const fs::path& file) {
    std::map<int, BatchRow> rows;
    std::error_code ignored;
    if (!fs::exists(file, ignored)) return rows;
    const std::string text = io::read_text(file, "batch", "expected a file that this program wrote");
    try {
        io::check_json_depth(text, file.string());
        const BatchJson json = BatchJson::parse(text, nullptr, false);
        for (const BatchJson& one : json) {
            BatchRow row;
            row.of = one.at("of").get<std::string>();
            row.failed = one.at("failed").get<bool>();
            for (const BatchJson& cell : one.at("cells"))
                row.cells.push_back(cell.is_string() ? io::CsvCell(cell.get<std::string>())
                                    : cell.is_null() ? io::CsvCell(std::numeric_limits<double>::quiet_NaN())
                                                     : io::CsvCell(cell.get<double>()));
            if (row.cells.size() != batch_columns) return {};
            rows[static_cast<int>(std::get<double>(row.cells[0]))] = std::move(row);
        }
    } catch (const std::exception&) {
        return {};  // all is made again
    }
    return rows;
}

void write_rows(const std::map<int, BatchRow>& rows, const fs::path& out) {
    std::string csv = header;
    BatchJson json = BatchJson::array();
    for (const auto& [number, row] : rows) {
        io::append_row(csv, row.cells);
        BatchJson cells = BatchJson::array();
        for (const io::CsvCell& cell : row.cells) {
            if (const double* value = std::get_if<double>(&cell))
                cells.push_back(*value);
            else
                cells.push_back(std::get<std::string>(cell));
        }
        json.push_back({{"of", row.of}, {"failed", row.failed}, {"cells", cells}});
    }
    const std::string kept = json.dump(-1, ' ', false, BatchJson::error_handler_t::replace);
    io::write_whole({{out / "batch.csv", csv}, {out / "batch.json", kept}});
}

bool is_in(const io::Shard& shard, int number) {
    return (number - 1) % shard.count == shard.index - 1;
}

void write_share(const BatchShare& share, const fs::path& folder) {
    const BatchJson json = {{"list", share.list},
                            {"runs", share.runs},
                            {"shard", share.shard.index},
                            {"shards", share.shard.count}};
    io::write_whole(folder / "shard.json", json.dump() + "\n");
}

BatchShare read_share(const fs::path& folder) {
    const fs::path file = folder / "shard.json";
    const std::string text =
        io::read_text(file, "shard", "expected a folder that 'batch LIST --shard i/n' wrote");
    io::check_json_depth(text, file.string());
    const BatchJson json = BatchJson::parse(text, nullptr, false);
    const auto number = [&json](const char* key, std::uint64_t most) -> std::uint64_t {
        const bool fits =
            json.contains(key) && json[key].is_number_unsigned() && json[key].get<std::uint64_t>() <= most;
        return fits ? json[key].get<std::uint64_t>() : 0;
    };
    BatchShare share;
    if (json.is_object() && json.contains("list") && json["list"].is_string()) {
        share.list = json["list"].get<std::string>();
        share.shard.index = static_cast<int>(number("shard", io::most_shards));
        share.shard.count = static_cast<int>(number("shards", io::most_shards));
        share.runs = number("runs", most_runs);
    }
    if (share.shard.index < 1 || share.shard.index > share.shard.count || share.runs < 1)
        throw io::InputError("{}: the shard is damaged; the command that made it writes it again",
                             file.string());
    return share;
}

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
        io::put_beside(made[k].first, out / made[k].second);
        if (options.progress) options.progress(k + 1, made.size(), 0);
    }
    write_rows(rows, out);
    result.runs = rows.size();
    for (const auto& [number, row] : rows) result.failed += row.failed;
    return result;
}

}  // namespace run
