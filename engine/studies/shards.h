#pragma once
/// A study cut into shards for a batch system to distribute; merged, they give the same bytes as one run.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/io/text.h"
#include "engine/studies/study.h"

namespace studies {

/// Runs one share and writes shard.csv, its rows, and shard.json, which says what they belong to. Throws
/// InputError, before any work, when the study has no pieces, there are more shards than pieces, or the
/// folder cannot be written.
void run_shard(const Study&, const io::Shard&, const std::filesystem::path& out, const StudyOptions&);

/// Turns the shards in these folders, given in any order, into what the whole run would have left. Returns
/// notices. `options` give threads, program and cache; the shards give the rest. Throws InputError and writes
/// nothing when a shard is missing, duplicate, damaged, or of another study, seed, size or program.
std::vector<std::string> merge_shards(std::span<const std::filesystem::path> folders,
                                      const std::filesystem::path& out, const StudyOptions& options);

}  // namespace studies
