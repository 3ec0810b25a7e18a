#include "engine/studies/shards.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/studies/study_files.h"

namespace studies {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<double>>;

/// Number of the first piece that is not in a shard before `index`.
int first_piece(int pieces, int index, int count) {
    return static_cast<int>(static_cast<long long>(pieces) * (index - 1) / count);
}

const PieceWork& pieces_of(const Study& study) {
    if (study.in_pieces) return *study.in_pieces;
    std::vector<std::string_view> ids;
    for (const Study& known : all_studies()) {
        if (known.in_pieces) ids.push_back(known.id);
    }
    throw io::InputError("--shard: study '{}' cannot be cut; those that can: {}", study.id, io::joined(ids));
}

/// What must be equal in all shards of a run.
Json identity(const Study& study, const StudyOptions& options, int shards) {
    return {{"study", study.id},
            {"program", options.program},
            {"quick", options.quick},
            {"seed", options.seed},
            {"shards", shards},
            {"pieces", study.in_pieces->pieces(options)},
            {"columns", study.in_pieces->columns(options)}};
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
    throw io::InputError("{}: {}", file.string(), why);
}

Json load(const std::filesystem::path& file) {
    const std::string text =
        io::read_text(file, "shard", "expected a folder that 'study ID --shard i/n' wrote");
    io::check_json_depth(text, file.string());
    const Json json = Json::parse(text, nullptr, false);
    const auto has = [&](const char* key, auto is) { return json.contains(key) && (json[key].*is)(); };
    const bool whole = json.is_object() && has("study", &Json::is_string) &&
                       has("program", &Json::is_string) && has("quick", &Json::is_boolean) &&
                       has("seed", &Json::is_number_unsigned) && has("shards", &Json::is_number_unsigned) &&
                       has("pieces", &Json::is_number_unsigned) && has("columns", &Json::is_array) &&
                       has("shard", &Json::is_number_unsigned) && has("rows", &Json::is_array);
    if (!whole) refuse(file, "the shard is damaged; run it again");
    return json;
}

/// Reads the rows of shard `index`; each piece must occur once and every value be a number.
Rows rows_of(const Json& json, const std::filesystem::path& file, int index) {
    const std::size_t columns = json["columns"].size();
    const int pieces = json["pieces"], shards = json["shards"];
    const int first = first_piece(pieces, index, shards), last = first_piece(pieces, index + 1, shards);
    Rows rows;
    for (const Json& row : json["rows"]) {
        const bool numbers = row.is_array() && row.size() == columns &&
                             std::all_of(row.begin(), row.end(), [](const Json& x) { return x.is_number(); });
        if (!numbers || row[0] != first + static_cast<int>(rows.size()))
            refuse(file, fmt::format("row {} is damaged; run the shard again", rows.size() + 1));
        rows.push_back(row.get<std::vector<double>>());
    }
    if (static_cast<int>(rows.size()) != last - first)
        refuse(file, fmt::format("{} rows were found; expected {}: run the shard again", rows.size(),
                                 last - first));
    return rows;
}

void check_same_run(const Json& own, const Json& expected, const std::filesystem::path& file,
                    const std::string& than) {
    for (const auto& [key, value] : expected.items()) {
        if (own[key] == value) continue;
        const std::string shown = value.is_array() ? "others" : value.dump();
        const std::string found = own[key].is_array() ? "" : " " + own[key].dump();
        refuse(file, fmt::format("{}{} was found where {} has {}; expected shards of one run", key, found,
                                 than, shown));
    }
}

}  // namespace

void run_shard(const Study& study, const io::Shard& shard, const std::filesystem::path& out,
               const StudyOptions& options) {
    const PieceWork& work = pieces_of(study);
    const int pieces = work.pieces(options);
    if (shard.count > pieces)
        throw io::InputError("--shard: {} shards were asked for; expected at most {}, one a piece",
                             shard.count, pieces);
    const io::OwnFolder own(out);
    Json json = identity(study, options, shard.count);
    json["shard"] = shard.index;
    json["rows"] = work.rows(options, first_piece(pieces, shard.index, shard.count),
                             first_piece(pieces, shard.index + 1, shard.count));
    io::write_whole(out / "shard.json", json.dump() + "\n");
}

std::vector<std::string> merge_shards(std::span<const std::filesystem::path> folders,
                                      const std::filesystem::path& out, const StudyOptions& options) {
    if (folders.empty())
        throw io::InputError("study merge: no folder was given; expected the folders of all shards of a run");
    StudyOptions of_run = options;
    const Study* study = nullptr;
    Json expected;
    std::vector<std::optional<Rows>> shards;
    for (const std::filesystem::path& folder : folders) {
        const std::filesystem::path file = folder / "shard.json";
        const Json json = load(file);
        if (!study) {
            study = &find_study(json["study"].get<std::string>());
            pieces_of(*study);
            of_run.quick = json["quick"];
            of_run.seed = json["seed"];
            const auto count = json["shards"].get<std::uint64_t>();
            if (count < 1 || count > io::most_shards) refuse(file, "the shard is damaged; run it again");
            expected = identity(*study, of_run, static_cast<int>(count));
            check_same_run(json, expected, file, "this program");
            shards.resize(count);
        }
        check_same_run(json, expected, file, folders.front().string());
        const auto index = json["shard"].get<std::uint64_t>();
        if (index < 1 || index > shards.size()) refuse(file, "the shard is damaged; run it again");
        if (shards[index - 1])
            refuse(file,
                   fmt::format("shard {}/{} was given twice; expected each once", index, shards.size()));
        shards[index - 1] = rows_of(json, file, static_cast<int>(index));
    }
    Rows rows;
    std::vector<std::string> missing;
    for (std::size_t i = 0; i < shards.size(); ++i) {
        if (!shards[i]) missing.push_back(fmt::format("{}/{}", i + 1, shards.size()));
        if (shards[i]) rows.insert(rows.end(), shards[i]->begin(), shards[i]->end());
    }
    if (!missing.empty())
        throw io::InputError("study merge: {} missing: {}; expected the folders of all shards",
                             missing.size() == 1 ? "a shard is" : "shards are", io::joined(missing));
    const io::OwnFolder own(out);
    return write_study(*study, study->in_pieces->finish(of_run, rows), out);
}

}  // namespace studies
