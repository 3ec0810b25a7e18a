#pragma once
/// Many runs from one list: scenarios × scripts × seeds × values of any key.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/io/text.h"
#include "engine/scenario/exercise_folders.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace run {

inline constexpr std::size_t most_runs = 100'000;  // of one list

/// One run of a batch.
struct BatchJob {
    int number = 0;  // from 1, in the order of the list
    std::filesystem::path scenario, commands;
    std::vector<scenario::Override> values;  // the seed among them
    bool images = false;

    /// "guidewire.friction=0.1 seed=3".
    std::string values_text() const;
};

struct BatchOptions {
    /// The exercise in a file, or of that name; `beside` is the list's folder. Throws InputError.
    std::function<scenario::ExerciseFiles(const std::string&, const std::filesystem::path& beside)> exercise;
    std::filesystem::path devices;
    std::filesystem::path list;  // the file of the list, which no output may replace
    script::Origin origin;       // program and learner of the recordings
    anatomy::ModelCache cache;
    int jobs = 2;
    std::optional<io::Shard> shard;  // only these runs of the list
    std::function<void(std::size_t done, std::size_t of, std::size_t failed)> progress;
    std::function<bool()> interrupted;
};

/// The jobs of a list:
///
///     schema = 1
///     [[run]]
///     scenario = "renal"                     # or a list of them
///     commands = "solution"                  # of the exercise; or a file, the name of another, a list
///     seeds = [1, 2, 3]                      # of the images' noise
///     images = true                          # frames as well; false is usual
///     [run.set]                              # every combination
///     "guidewire.friction" = [0.0, 0.1]
///
/// Throws InputError with file:line:column for an unknown key, a file that does not exist, or too many runs.
std::vector<BatchJob> load_batch(const std::filesystem::path&, const BatchOptions&);

struct BatchResult {
    std::size_t of = 0;                             // runs that were asked for
    std::size_t runs = 0, skipped = 0, failed = 0;  // skipped: made by an earlier call
    bool interrupted = false;
};

/// Makes the runs, each in a folder of its own number in `out`, and batch.csv with a row for each. A run that
/// fails has its reason in its row, and does not end the others. Called again, only what is missing, has
/// failed, or has changed is made. With `shard`, shard.json says which share the folder holds, for
/// merge_batch. Throws InputError when `out` cannot be written, or there are more shards than runs.
BatchResult run_batch(const std::vector<BatchJob>& list, const std::filesystem::path& out,
                      const BatchOptions&);

/// Turns the folders of all shards of a list, in any order, into the files that run_batch would have left
/// for the whole list, byte for byte; the shards stay. Throws InputError and
/// changes nothing when a shard is missing, unfinished, there twice, being made, or of another list, or when
/// `out` has runs. Uses `progress` and `interrupted` of the options.
BatchResult merge_batch(std::span<const std::filesystem::path> folders, const std::filesystem::path& out,
                        const BatchOptions&);

}  // namespace run
