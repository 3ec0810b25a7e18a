#include "engine/io/shard.h"

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace io {

Shard parse_shard(std::string_view text) {
    const std::size_t slash = text.find('/');
    if (slash != std::string_view::npos) {
        const auto index = parse_integer(text.substr(0, slash)),
                   count = parse_integer(text.substr(slash + 1));
        if (index && count && *index >= 1 && *index <= *count && *count <= most_shards)
            return {*index, *count};
    }
    throw InputError("--shard: '{}' was found; expected i/n with 1 <= i <= n <= {}", text, most_shards);
}

}  // namespace io
