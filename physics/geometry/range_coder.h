#pragma once
/// Adaptive binary arithmetic coding: numbers as bytes, about as few as their frequencies allow. One function
/// describes a format for both directions, as a state's does:
///
///     void format(RangeCoder& c) { c.number(model_, value_); }

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

namespace geometry {

/// How often a bit has been 1, of late and for longer.
class BitModel {
public:
    std::uint32_t one() const { return (fast_ + slow_) >> 5; }  // of 4096, from 1 to 4095
    void saw(bool bit) {
        fast_ += ((bit ? top : least) - fast_) / 16;
        slow_ += ((bit ? top : least) - slow_) / 128;
    }

private:
    static constexpr int top = 65520, least = 16;
    int fast_ = 32768, slow_ = 32768;
};

/// A number by its count of bits, its sign and its first bits after the leading one, each adaptive.
struct NumberModel {
    std::array<BitModel, 64> width;
    std::array<BitModel, 32> sign;
    std::array<std::array<BitModel, 8>, 32> top;
};

/// Writes, or reads what one that wrote has written.
class RangeCoder {
public:
    RangeCoder() = default;
    explicit RangeCoder(std::span<const std::byte> packed) : reads_(true), in_(packed) {
        next();  // the first byte of a stream is 0
        for (int k = 0; k < 4; ++k) code_ = code_ << 8 | next();
    }
    bool reads() const { return reads_; }

    bool bit(BitModel& model, bool value) {
        const std::uint32_t bound = (range_ >> 12) * model.one();
        if (reads_) value = code_ < bound;
        if (value) {
            range_ = bound;
        } else {
            if (reads_)
                code_ -= bound;
            else
                low_ += bound;
            range_ -= bound;
        }
        model.saw(value);
        settle();
        return value;
    }
    /// Bits of which nothing is known, at most 32.
    std::uint32_t plain(int count, std::uint32_t value) {
        std::uint32_t all = 0;
        for (int k = count - 1; k >= 0; --k) {
            range_ >>= 1;
            bool one = value >> k & 1;
            if (reads_) {
                one = code_ >= range_;
                if (one) code_ -= range_;
            } else if (one) {
                low_ += range_;
            }
            settle();
            all = all << 1 | static_cast<std::uint32_t>(one);
        }
        return all;
    }
    /// One of 2^bits symbols.
    template <std::size_t N>
    int symbol(std::array<BitModel, N>& tree, int bits, int value) {
        std::size_t node = 1;
        for (int k = bits - 1; k >= 0; --k)
            node = node << 1 | static_cast<std::size_t>(bit(tree[node % N], value >> k & 1));
        return static_cast<int>(node) - (1 << bits);
    }
    /// Any but the least of all.
    std::int32_t number(NumberModel& model, std::int32_t value) {
        const auto size = static_cast<std::uint32_t>(value < 0 ? -std::int64_t{value} : value);
        const int width = symbol(model.width, 5, static_cast<int>(std::bit_width(size)));
        if (width == 0) return 0;
        std::uint32_t found = 1;
        int left = width - 1;
        for (std::size_t node = 1; left > 0 && node < 8;) {
            --left;
            const bool one = bit(model.top[static_cast<std::size_t>(width)][node], size >> left & 1);
            node = node << 1 | static_cast<std::size_t>(one);
            found = found << 1 | static_cast<std::uint32_t>(one);
        }
        if (left > 0) found = found << left | plain(left, size & ((std::uint32_t{1} << left) - 1));
        const bool below = bit(model.sign[static_cast<std::size_t>(width)], value < 0);
        return below ? -static_cast<std::int32_t>(found) : static_cast<std::int32_t>(found);
    }
    /// What was written, to be called once, at the end.
    std::string take() {
        for (int k = 0; k < 5; ++k) shift();
        return std::move(out_);
    }

private:
    void settle() {
        while (range_ < std::uint32_t{1} << 24) {
            range_ <<= 8;
            if (reads_)
                code_ = code_ << 8 | next();
            else
                shift();
        }
    }
    /// Moves a byte out; a carry may still reach those that wait.
    void shift() {
        if (low_ < 0xff000000u || low_ > 0xffffffffu) {
            const auto carry = static_cast<std::uint8_t>(low_ >> 32);
            for (; waiting_ > 0; --waiting_) {
                out_.push_back(static_cast<char>(static_cast<std::uint8_t>(held_ + carry)));
                held_ = 0xff;
            }
            held_ = static_cast<std::uint8_t>(low_ >> 24);
        }
        ++waiting_;
        low_ = (low_ & 0x00ffffffu) << 8;
    }
    std::uint32_t next() {
        if (at_ >= in_.size()) throw std::runtime_error("packed numbers are cut short");
        return static_cast<std::uint32_t>(in_[at_++]);
    }

    bool reads_ = false;
    std::uint32_t range_ = 0xffffffffu;
    // Of the one that writes.
    std::uint64_t low_ = 0;
    std::size_t waiting_ = 1;
    std::uint8_t held_ = 0;
    std::string out_;
    // Of the one that reads.
    std::uint32_t code_ = 0;
    std::span<const std::byte> in_;
    std::size_t at_ = 0;
};

}  // namespace geometry
