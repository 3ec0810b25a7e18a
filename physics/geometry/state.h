#pragma once
/// The state of an object at a moment, as a stream of bytes. A class passes everything that its future
/// depends on to a stream, field by field, in one function
///
///     void state(StateStream& s) { s(time_, wire_, waiting_); }
///
/// which serves three streams: one writes the fields, one hashes them, one reads them back. The function
/// leaves out scratch and whatever follows from other fields; `s.restores()` says when those must be made
/// again.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "physics/geometry/hash.h"

namespace geometry {

class StateStream;

template <class T>
concept HasState = requires(T& object, StateStream& stream) {
    object.state(stream);
};

template <class T>
inline constexpr bool plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T>
inline constexpr bool fixed = false;
template <class T, int Rows, int Columns>
inline constexpr bool fixed<Eigen::Matrix<T, Rows, Columns>> = Rows > 0 && Columns > 0;

class StateStream {
public:
    virtual ~StateStream() = default;

    /// Fields, in order: numbers, enumerators, vectors and matrices of fixed size, classes with a state, and
    /// strings, lists and options of those.
    template <class... Fields>
    void operator()(Fields&... fields) {
        (field(fields), ...);
    }
    /// Fields that no later state depends on, such as readouts of the last frame: kept and read back, but no
    /// part of the hash.
    template <class... Fields>
    void beside(Fields&... fields) {
        if (!hashes()) (field(fields), ...);
    }
    /// A list that is no part of the hash while it is empty, so that the states of a recording made before
    /// there was such a list keep their hashes.
    template <class T>
    void unless_empty(std::vector<T>& items) {
        if (!hashes() || !items.empty()) field(items);
    }
    /// The same of a number that is no part of the hash while it is 0.
    template <class T>
    void unless_zero(T& number) {
        if (!hashes() || number != T{}) field(number);
    }
    /// Whether fields are read back.
    virtual bool restores() const { return false; }

protected:
    virtual void raw(void* data, std::size_t bytes) = 0;
    virtual bool hashes() const { return false; }

private:
    template <class T>
    void field(T& value) {
        static_assert(!std::is_const_v<T>, "a state is written by what could read it back");
        if constexpr (HasState<T>) {
            value.state(*this);
        } else if constexpr (fixed<T>) {
            raw(value.data(), static_cast<std::size_t>(value.size()) * sizeof(typename T::Scalar));
        } else {
            static_assert(plain<T>, "a field without a state");
            raw(&value, sizeof value);
        }
    }
    void field(std::string& text) {
        resize(text);
        raw(text.data(), text.size());
    }
    template <class T>
    void field(std::vector<T>& items) {
        resize(items);
        if constexpr (plain<T> || fixed<T>)
            raw(items.data(), items.size() * sizeof(T));
        else
            for (T& item : items) field(item);
    }
    template <class T>
    void field(std::deque<T>& items) {
        resize(items);
        for (T& item : items) field(item);
    }
    template <class T, std::size_t N>
    void field(std::array<T, N>& items) {
        for (T& item : items) field(item);
    }
    template <class T>
    void field(std::optional<T>& option) {
        std::uint64_t has = option.has_value();
        raw(&has, sizeof has);
        if (restores()) {
            option.reset();
            if (has) option.emplace();
        }
        if (option) field(*option);
    }
    template <class List>
    void resize(List& list) {
        std::uint64_t size = list.size();
        raw(&size, sizeof size);
        if (restores()) {
            require(size);
            list.resize(static_cast<std::size_t>(size));
        }
    }
    /// Checks that this many items can still follow.
    virtual void require(std::uint64_t) {}
};

/// Keeps the bytes.
class StateWriter final : public StateStream {
public:
    std::vector<std::byte> take() { return std::move(bytes_); }

private:
    void raw(void* data, std::size_t bytes) override {
        const auto* from = static_cast<const std::byte*>(data);
        bytes_.insert(bytes_.end(), from, from + bytes);
    }
    std::vector<std::byte> bytes_;
};

/// Keeps a hash of the bytes.
class StateHash final : public StateStream {
public:
    std::uint64_t value() const { return hash_.value(); }

private:
    void raw(void* data, std::size_t bytes) override { hash_.add(data, bytes); }
    bool hashes() const override { return true; }
    Hash hash_;
};

/// Reads the bytes back. Throws std::runtime_error when there are fewer than the fields need; call finish()
/// at the end, which throws when some are left over.
class StateReader final : public StateStream {
public:
    explicit StateReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
    bool restores() const override { return true; }
    void finish() const {
        if (!bytes_.empty()) throw std::runtime_error("a state of something else: it is too long");
    }

private:
    void raw(void* data, std::size_t bytes) override {
        require(bytes);
        if (bytes > 0) std::memcpy(data, bytes_.data(), bytes);
        bytes_ = bytes_.subspan(bytes);
    }
    void require(std::uint64_t bytes) override {
        if (bytes > bytes_.size()) throw std::runtime_error("a state of something else: it is too short");
    }
    std::span<const std::byte> bytes_;
};

/// The state of any object that has one; writing changes nothing.
template <HasState T>
std::vector<std::byte> state_of(const T& object) {
    StateWriter writer;
    const_cast<T&>(object).state(writer);
    return writer.take();
}
template <HasState T>
std::uint64_t state_hash_of(const T& object) {
    StateHash hash;
    const_cast<T&>(object).state(hash);
    return hash.value();
}
/// When it throws, the object must not be used any more.
template <HasState T>
void restore_state(T& object, std::span<const std::byte> state) {
    StateReader reader(state);
    object.state(reader);
    reader.finish();
}

}  // namespace geometry
