#pragma once
/// Shares of a piece of work, for several machines.

#include <string_view>

namespace io {

inline constexpr int most_shards = 100'000;

/// The `index`-th of `count` equal shares, counted from 1.
struct Shard {
    int index = 1, count = 1;
};

/// "i/n", 1 ≤ i ≤ n ≤ most_shards. Throws InputError, which names the option --shard.
Shard parse_shard(std::string_view);

}  // namespace io
