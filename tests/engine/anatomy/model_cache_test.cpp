#include "engine/anatomy/model_cache.h"

#include <atomic>
#include <sys/stat.h>
#include <thread>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

namespace fs = std::filesystem;

std::string bytes(std::size_t count) {
    return std::string(count, 'x');
}

}  // namespace

TEST(ModelCache, OneLooksAfterAPlaceWhileTheOtherWaits) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder / "cache", {}};
    std::atomic<int> made = 0;
    const auto work = [&] {
        const CachePlace place(cache, "field-1.bin");
        if (fs::exists(place.path())) return;
        ++made;
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        place.keep_file("content");
    };
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(made, 1);
    EXPECT_EQ(test::read(folder / "cache/field-1.bin"), "content");
    // Neither locks nor parts are left.
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "cache"), {}), 1);
}

TEST(ModelCache, WhatWasNotUsedForLongestGoesFirst) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder.path(), {}};
    for (const char* name : {"field-a.bin", "field-b.bin", "ct-c.bin"}) {
        CachePlace(cache, name).keep_file(bytes(1000));
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    test::write(folder / "mine.txt", "not of the cache");
    CachePlace(cache, "field-a.bin").used();
    std::vector<CacheItem> items = cache_items(folder.path());
    ASSERT_EQ(items.size(), 3u);
    EXPECT_EQ(items[0].path.filename(), "field-a.bin");
    EXPECT_EQ(items[2].path.filename(), "field-b.bin");
    EXPECT_EQ(items[1].bytes, 1000u);
    const std::vector<CacheItem> removed = shrink_cache(folder.path(), 2500).removed;
    ASSERT_EQ(removed.size(), 1u);
    EXPECT_EQ(removed[0].path.filename(), "field-b.bin");
    shrink_cache(folder.path(), 0);
    EXPECT_TRUE(cache_items(folder.path()).empty());
    EXPECT_TRUE(fs::exists(folder / "mine.txt"));
}

TEST(ModelCache, ADamagedAnatomyIsMadeAgain) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder.path(), {}};
    const VesselTreeSpec spec = vessel_preset("rca");
    const std::uint64_t hash = hash_of(generated_anatomy(spec, cache));
    const fs::path file = cache_items(folder.path()).at(0).path;
    const std::string whole = test::read(file);
    std::string changed = whole, of_another = whole;
    changed[whole.size() / 2] ^= 1;
    of_another[8] ^= 1;  // the key
    for (const std::string& damaged :
         {changed, of_another, whole + "x", whole.substr(0, whole.size() / 2), whole.substr(0, 20)}) {
        test::write(file, damaged);
        const int before = made(Made::Vessels);
        EXPECT_FALSE(is_kept(spec, cache));
        EXPECT_EQ(hash_of(generated_anatomy(spec, cache)), hash);
        EXPECT_EQ(made(Made::Vessels), before + 1);
        EXPECT_EQ(test::read(file), whole);
    }
}

TEST(ModelCache, AFolderThatCannotBeWrittenIsNotedOnce) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    int notes = 0;
    const ModelCache cache{folder / "file/cache", {}, [&](const std::string& text) {
                               ++notes;
                               test::expect_said(text, "cannot be kept");
                           }};
    for (int i = 0; i < 2; ++i) {
        const CachePlace place(cache, "field-1.bin");
        EXPECT_FALSE(place.keep_file("content"));
    }
    EXPECT_EQ(notes, 1);
}

TEST(ModelCache, LeftoversOfProcessesThatEndedAreRemoved) {
    const test::TemporaryFolder folder;
    test::write(folder / "field-1.bin.999999999.1.part", "half");
    fs::create_directory(folder / "anatomy-1.999999999.2.part");
    test::write(folder / "anatomy-1.999999999.2.part/a", "half");
    const std::string own = "field-2.bin." + std::to_string(::getpid()) + ".3.part";
    test::write(folder / own, "being written");
    const ModelCache cache{folder.path(), {}};
    { const CachePlace place(cache, "field-3.bin"); }
    EXPECT_FALSE(fs::exists(folder / "field-1.bin.999999999.1.part"));
    EXPECT_FALSE(fs::exists(folder / "anatomy-1.999999999.2.part"));
    EXPECT_TRUE(fs::exists(folder / own));
}

TEST(ModelCache, VesselsHaveTheSameBitsWhetherTheyCanBeKeptOrNot) {
    const test::TemporaryFolder folder;
    const VesselTreeSpec spec = vessel_preset("rca", 2);
    const ModelCache none, cache{folder.path(), {}};
    const std::uint64_t hash = hash_of(generated_anatomy(spec, none));
    EXPECT_EQ(hash_of(generated_anatomy(spec, cache)), hash);  // just grown
    EXPECT_EQ(hash_of(generated_anatomy(spec, cache)), hash);  // read
}

TEST(ModelCache, WhatIsNoFileInThePlaceOfOneIsReplaced) {
    const test::TemporaryFolder folder;
    test::write(folder / "mine", "mine");
    const ModelCache cache{folder.path(), {}};
    const CachePlace place(cache, "field-1.bin");
    const auto keeps = [&] {
        EXPECT_TRUE(place.keep_file("content"));
        EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder / "field-1.bin")));
        EXPECT_EQ(test::read(folder / "field-1.bin"), "content");
        fs::remove(folder / "field-1.bin");
    };
    ASSERT_EQ(::mkfifo((folder / "field-1.bin").c_str(), 0600), 0);
    ASSERT_EQ(cache_items(folder.path()).size(), 1u);
    EXPECT_EQ(cache_items(folder.path())[0].bytes, 0u);
    keeps();
    for (const char* target : {"/dev/null", "/dev/full", "mine", "nowhere/x"}) {
        fs::create_symlink(target, folder / "field-1.bin");
        keeps();
    }
    fs::create_directory(folder / "field-1.bin");
    keeps();
    EXPECT_EQ(test::read(folder / "mine"), "mine");
    ASSERT_EQ(::mkfifo((folder / "field-2.bin").c_str(), 0600), 0);
    EXPECT_EQ(shrink_cache(folder.path(), 0).removed.size(), 1u);
}

}  // namespace anatomy
