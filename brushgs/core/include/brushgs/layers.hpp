// Layers of a picture besides its color: in each pixel the alpha-weighted mean of an attribute of the boxes. So far
// there is one, the depth. The attributes of layers are defined in brushgs/values/boxes.py; here a layer is one channel
// or several, and a channel is one number per box (the attribute) or per pixel (its mean).
#pragma once

#include <cstddef>

namespace brushgs {

// Channels that the layers of a picture may have in all. The kernels are compiled for each number from 0 to this.
constexpr int kMostChannels = 1;

// One value every `stride` scalars: of an array [rows, width] each column is a channel of stride `width`.
template <class T>
struct Channel {
    T* values;
    std::size_t stride;
};

template <class T>
struct Channels {
    int count;
    Channel<T> channels[kMostChannels];  // the first `count`
};

// Calls `work.operator()<count>()`.
template <int n = kMostChannels, class Work>
void with_channels(int count, const Work& work) {
    if constexpr (n > 0) {
        if (count < n) return with_channels<n - 1>(count, work);
    }
    work.template operator()<n>();
}

}  // namespace brushgs
