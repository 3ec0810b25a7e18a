#pragma once
/// What a batch keeps of its runs: rows to go on from, and the share that a shard's folder holds.

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/io/csv.h"
#include "engine/io/text.h"

namespace run {

/// Of batch.csv.
inline constexpr std::size_t batch_columns = 32;

/// What is kept of a run, to go on from.
struct BatchRow {
    std::string of;                  // identity of scenario, script, program and what was asked for
    std::vector<io::CsvCell> cells;  // of batch.csv; the first is the run's number
    bool failed = false;
};

/// The folder of a run: "000012".
std::string run_folder(int number);

/// Rows as they were left in batch.json; none where there are none that can be read.
std::map<int, BatchRow> kept_rows(const std::filesystem::path&);
/// Writes batch.csv and batch.json. Throws InputError.
void write_rows(const std::map<int, BatchRow>&, const std::filesystem::path& out);

/// What a shard's folder is of.
struct BatchShare {
    std::string list;  // hash of the whole list and of the program
    io::Shard shard;
    std::size_t runs = 0;  // of the whole list
};

/// Every count-th run belongs to a shard, so that shards of a list take about as long.
bool is_in(const io::Shard&, int number);

/// shard.json. Both throw InputError.
void write_share(const BatchShare&, const std::filesystem::path& folder);
BatchShare read_share(const std::filesystem::path& folder);

}  // namespace run
