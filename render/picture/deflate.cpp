#include "render/picture/deflate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <libdeflate.h>
#include <memory>

namespace render {
namespace {

constexpr std::size_t block_size = 65536;           // bytes that share codes
constexpr int longest_code = 14;                    // [bits]: four codes and the rest of a byte fit in 64
constexpr int shortest_run = 3, longest_run = 258;  // lengths that have a symbol
constexpr int end_of_block = 256, literal_symbols = 286;

struct Code {
    std::uint32_t bits = 0;  // the lowest bit is written first
    int length = 0;          // 0 for a symbol that does not occur
};

/// Packs bits into bytes, the lowest first.
class BitWriter {
public:
    explicit BitWriter(std::uint8_t* to) : to_(to) {}
    /// Accepts up to 57 bits between two calls of `flush`, which may write up to 8 bytes beyond the end.
    void put(std::uint64_t bits, int count) {
        waiting_ |= bits << count_;
        count_ += count;
    }
    void put(Code code) { put(code.bits, code.length); }
    void flush() {
        for (int k = 0; k < 8; ++k) to_[k] = static_cast<std::uint8_t>(waiting_ >> 8 * k);
        const int whole = count_ / 8;
        to_ += whole;
        waiting_ >>= 8 * whole;
        count_ -= 8 * whole;
    }
    /// Fills up the last byte with zeros.
    std::uint8_t* finish() {
        flush();
        return count_ > 0 ? to_ + 1 : to_;
    }

private:
    std::uint8_t* to_;
    std::uint64_t waiting_ = 0;
    int count_ = 0;
};

/// Lengths of Huffman codes for these numbers of occurrences, none above `limit`: Huffman's own where they
/// stay below it, otherwise nearly optimal, with some shortened and others lengthened to fit.
void code_lengths(std::span<const std::uint32_t> counts, int limit, std::span<Code> codes) {
    struct Node {
        std::uint32_t count;
        int symbol;
    };
    std::array<Node, literal_symbols> used;
    int leaves = 0;
    for (std::size_t symbol = 0; symbol < counts.size(); ++symbol) {
        codes[symbol] = {};
        if (counts[symbol] > 0) used[leaves++] = {counts[symbol], static_cast<int>(symbol)};
    }
    if (leaves < 2) {
        if (leaves == 1) codes[used[0].symbol].length = 1;
        return;
    }
    std::sort(used.begin(), used.begin() + leaves, [](const Node& a, const Node& b) {
        return a.count != b.count ? a.count < b.count : a.symbol < b.symbol;
    });
    // Leaves in ascending order, then the nodes that join two, which are created in ascending order.
    const int nodes = 2 * leaves - 1;
    std::array<std::uint32_t, 2 * literal_symbols> weight;
    std::array<int, 2 * literal_symbols> parent, depth;
    for (int i = 0; i < leaves; ++i) weight[i] = used[i].count;
    int leaf = 0, joint = leaves;
    for (int next = leaves; next < nodes; ++next) {
        weight[next] = 0;
        for (int child = 0; child < 2; ++child) {
            const bool takes_leaf = leaf < leaves && (joint == next || weight[leaf] <= weight[joint]);
            const int taken = takes_leaf ? leaf++ : joint++;
            weight[next] += weight[taken];
            parent[taken] = next;
        }
    }
    std::array<int, 16> of_length{};  // number of codes
    depth[nodes - 1] = 0;
    for (int i = nodes - 2; i >= 0; --i) {
        depth[i] = depth[parent[i]] + 1;
        if (i < leaves) ++of_length[std::min(depth[i], limit)];
    }
    // Shortened codes take more room than there is. One of the longest gives up its place and shares that of
    // a shorter one.
    int room = -(1 << limit);
    for (int length = 1; length <= limit; ++length) room += of_length[length] << (limit - length);
    for (; room > 0; --room) {
        int length = limit - 1;
        while (of_length[length] == 0) --length;
        --of_length[length];
        of_length[length + 1] += 2;
        --of_length[limit];
    }
    int rarest = 0;
    for (int length = limit; length > 0; --length)
        for (int i = 0; i < of_length[length]; ++i) codes[used[rarest++].symbol].length = length;
}

/// Assigns the codes that follow from their lengths (RFC 1951, 3.2.2).
void assign_codes(std::span<Code> codes) {
    std::array<std::uint32_t, 17> next{};
    for (const Code& code : codes)
        if (code.length > 0) ++next[code.length + 1];
    for (std::size_t length = 1; length < next.size(); ++length)
        next[length] = 2 * (next[length - 1] + next[length]);
    for (Code& code : codes) {
        if (code.length == 0) continue;
        const std::uint32_t value = next[code.length]++;
        code.bits = 0;
        for (int bit = 0; bit < code.length; ++bit)
            code.bits |= (value >> bit & 1u) << (code.length - 1 - bit);
    }
}

/// A symbol with the bits that follow it.
struct Symbol {
    int symbol, extra, extra_bits;
};

/// The symbol of a run of 3 to 258 (RFC 1951, 3.2.5).
Symbol run_symbol(int length) {
    if (length == longest_run) return {285, 0, 0};
    const auto over = static_cast<unsigned>(length - shortest_run);
    if (over < 8) return {257 + static_cast<int>(over), 0, 0};
    const int bits = static_cast<int>(std::bit_width(over)) - 3;
    return {261 + 4 * bits + static_cast<int>(over >> bits & 3), static_cast<int>(over & ((1u << bits) - 1)),
            bits};
}

/// Calls use(length) with pieces of a run that all have a symbol.
template <class Use>
void split_run(std::size_t run, const Use& use) {
    while (run > 0) {
        const std::size_t most = longest_run;
        const std::size_t piece =
            run > most && run < most + shortest_run ? most - shortest_run : std::min(run, most);
        use(static_cast<int>(piece));
        run -= piece;
    }
}

/// Literal bytes, then a run that repeats the last of them.
struct Stretch {
    std::size_t literals, run;
};

/// Finds runs eight bytes at a time, which costs next to nothing in noise. `at` and `end` are positions in
/// `bytes`.
void find_runs(const std::uint8_t* bytes, std::size_t at, std::size_t end, std::vector<Stretch>& found) {
    constexpr std::size_t together = 8;
    found.clear();
    std::size_t literals_from = at;
    if (at == 0) ++at;  // the first byte has none before it to repeat
    while (at + together <= end) {
        if (std::memcmp(bytes + at, bytes + at - 1, together) != 0) {
            at += together;
            continue;
        }
        std::size_t after = at + together;
        while (after + together <= end && std::memcmp(bytes + after, bytes + after - 1, together) == 0)
            after += together;
        while (after < end && bytes[after] == bytes[at]) ++after;
        while (at > literals_from && at > 1 && bytes[at - 1] == bytes[at - 2]) --at;
        found.push_back({at - literals_from, after - at});
        literals_from = at = after;
    }
    found.push_back({end - literals_from, 0});
}

/// Symbols of a list of code lengths: a length, or 16 to 18, which repeat the length or zero (RFC 1951,
/// 3.2.7).
void list_lengths(std::span<const int> lengths, std::vector<Symbol>& list) {
    list.clear();
    for (std::size_t i = 0; i < lengths.size();) {
        std::size_t same = 1;
        while (i + same < lengths.size() && lengths[i + same] == lengths[i]) ++same;
        i += same;
        const int length = lengths[i - 1];
        int left = static_cast<int>(same);
        if (length != 0) {
            list.push_back({length, 0, 0});
            --left;
        }
        while (left > 0) {
            if (left < 3) {
                list.push_back({length, 0, 0});
                --left;
                continue;
            }
            const int taken = std::min(left, length != 0 ? 6 : 138);
            if (length != 0)
                list.push_back({16, taken - 3, 2});
            else if (taken <= 10)
                list.push_back({17, taken - 3, 3});
            else
                list.push_back({18, taken - 11, 7});
            left -= taken;
        }
    }
}

/// Maximum for a block [bytes].
constexpr std::size_t most_of_header = (17 + 3 * 19 + 14 * (literal_symbols + 1) + 7) / 8;

/// Begins a block and writes its codes (RFC 1951, 3.2.7). All runs have the same distance, 1, with a code of
/// one bit.
BitWriter put_header(BitWriter out, std::span<const Code> literals, bool last) {
    int count = literal_symbols;
    while (literals[count - 1].length == 0) --count;
    std::array<int, literal_symbols + 1> lengths;
    for (int i = 0; i < count; ++i) lengths[i] = literals[i].length;
    lengths[count] = 1;
    std::vector<Symbol> list;
    list_lengths(std::span(lengths).first(count + 1), list);
    std::array<std::uint32_t, 19> counts{};
    for (const Symbol& entry : list) ++counts[entry.symbol];
    std::array<Code, 19> codes;
    code_lengths(counts, 7, codes);
    assign_codes(codes);
    constexpr std::array<int, 19> order = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    int listed = 19;
    while (listed > 4 && codes[order[listed - 1]].length == 0) --listed;

    constexpr int dynamic_codes = 2;
    out.put(last ? 1 : 0, 1);
    out.put(dynamic_codes, 2);
    out.put(static_cast<std::uint64_t>(count - 257), 5);
    out.put(0, 5);  // one distance
    out.put(static_cast<std::uint64_t>(listed - 4), 4);
    out.flush();
    for (int i = 0; i < listed; ++i) {
        out.put(static_cast<std::uint64_t>(codes[order[i]].length), 3);
        out.flush();
    }
    for (const Symbol& entry : list) {
        out.put(codes[entry.symbol]);
        out.put(static_cast<std::uint64_t>(entry.extra), entry.extra_bits);
        out.flush();
    }
    return out;
}

/// Writes one block's bytes from `from`, cut into stretches.
BitWriter put_block(BitWriter out, const std::uint8_t* from, std::span<const Stretch> stretches, bool last) {
    // Four counts of each byte, so that equal consecutive bytes need not wait for each other.
    std::array<std::array<std::uint32_t, 256>, 4> of_byte{};
    std::array<std::uint32_t, literal_symbols> counts{};
    const std::uint8_t* byte = from;
    for (const Stretch& stretch : stretches) {
        const std::uint8_t* const end = byte + stretch.literals;
        for (; end - byte >= 4; byte += 4)
            for (int k = 0; k < 4; ++k) ++of_byte[k][byte[k]];
        for (; byte < end; ++byte) ++of_byte[0][*byte];
        split_run(stretch.run, [&](int length) { ++counts[run_symbol(length).symbol]; });
        byte += stretch.run;
    }
    for (int i = 0; i < 256; ++i)
        for (const auto& some : of_byte) counts[i] += some[i];
    counts[end_of_block] = 1;
    std::array<Code, literal_symbols> codes;
    code_lengths(counts, longest_code, codes);
    assign_codes(codes);
    out = put_header(out, codes, last);

    byte = from;
    for (const Stretch& stretch : stretches) {
        const std::uint8_t* const end = byte + stretch.literals;
        for (; end - byte >= 4; byte += 4) {
            for (int k = 0; k < 4; ++k) out.put(codes[byte[k]]);
            out.flush();
        }
        for (; byte < end; ++byte) out.put(codes[*byte]), out.flush();
        split_run(stretch.run, [&](int length) {
            const Symbol run = run_symbol(length);
            out.put(codes[run.symbol]);
            out.put(static_cast<std::uint64_t>(run.extra), run.extra_bits);
            out.put(0, 1);  // the distance
            out.flush();
        });
        byte += stretch.run;
    }
    out.put(codes[end_of_block]);
    out.flush();
    return out;
}

}  // namespace

void deflate_noise(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& to) {
    const std::size_t blocks = std::max<std::size_t>(1, (bytes.size() + block_size - 1) / block_size);
    const std::size_t most = bytes.size() * longest_code / 8 + blocks * (most_of_header + 4) + 16;
    // Kept from image to image: fresh memory would cost more than the compression of what is flat.
    struct Scratch {
        std::unique_ptr<std::uint8_t[]> bytes;
        std::size_t size = 0;
    };
    thread_local Scratch packed;
    if (packed.size < most) packed = {std::make_unique_for_overwrite<std::uint8_t[]>(most), most};
    BitWriter out(packed.bytes.get());
    out.put(0x0178, 16);  // deflate with a window of 32 kB; the quickest level
    std::vector<Stretch> stretches;
    for (std::size_t block = 0; block < blocks; ++block) {
        const std::size_t from = block * block_size, end = std::min(from + block_size, bytes.size());
        find_runs(bytes.data(), from, end, stretches);
        out = put_block(out, bytes.data() + from, stretches, block + 1 == blocks);
    }
    std::uint8_t* const end = out.finish();
    to.insert(to.end(), packed.bytes.get(), end);
    const std::uint32_t check = libdeflate_adler32(1, bytes.data(), bytes.size());
    for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::uint8_t>(check >> shift));
}

}  // namespace render
