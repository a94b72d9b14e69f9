// One object as Python holds it, and who may touch it when.
//
// A call that may take long releases the GIL and looks for signals now and then. One object serves
// one call at a time: calls from several threads take turns, those on different objects do not
// wait for each other.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "../object.hpp"
#include "numpy.hpp"

namespace flintknap {

class Kernel {
   public:
    // To be held while the object is used; tells its revision when it ends.
    class Turn {
       public:
        Turn() = default;
        explicit Turn(Kernel* kernel) : kernel_(kernel) {}
        Turn(Turn&& other) noexcept : kernel_(std::exchange(other.kernel_, nullptr)) {}
        Turn& operator=(Turn&&) = delete;
        ~Turn() {
            if (kernel_ == nullptr) return;
            kernel_->told_.store(kernel_->object_->points().revision(), std::memory_order_relaxed);
            kernel_->is_taken_ = false;
            kernel_->mutex_.unlock();
        }

       private:
        Kernel* kernel_ = nullptr;
    };

    explicit Kernel(Limit limit) : object_(std::make_unique<Object>(limit)) {}

    const Object& object() const { return *object_; }
    Object& object() { return *object_; }
    void replace(std::unique_ptr<Object> object) { object_ = std::move(object); }

    // Never waits for the lock with the GIL: who holds the lock may be waiting for the GIL.
    Turn take_turn() {
        if (!mutex_.try_lock()) {
            nb::gil_scoped_release others_may_run;
            mutex_.lock();
        }
        is_taken_ = true;
        return Turn(this);
    }

    // The revision when the last turn ended; for those who have none.
    std::int64_t told_revision() const { return told_.load(std::memory_order_relaxed); }

    // This object's turn, with all points in the triangulation.
    Turn placed() {
        Turn turn = take_turn();
        if (!object_->is_placed()) bring_up([&](auto poll) { object_->place(poll); });
        return turn;
    }

    // This object's turn, with everything up to date.
    Turn settled() {
        Turn turn = take_turn();
        settle();
        return turn;
    }

    // The same, the ring as a sequence included.
    Turn with_ring() {
        Turn turn = take_turn();
        if (object_->is_ring_fresh()) return turn;
        settle();
        if (object_->is_long_to_update_ring()) {
            nb::gil_scoped_release others_may_run;
            object_->update_ring();
        } else {
            object_->update_ring();
        }
        return turn;
    }

    // Asks the object, its ring included, in its turn, which costs no lock if there is nothing to
    // wait for or to do: nobody else can take it before the GIL is let go, and `ask` keeps that. A
    // lock waits for all that was read before it, so the next call could not begin meanwhile.
    template <class Ask>
    auto ask(Ask ask) {
        if (!is_taken_ && object_->is_ring_fresh()) return ask(*object_);
        Turn turn = with_ring();
        return ask(*object_);
    }

    // The same, with the ring as results hold it instead.
    Turn with_outline() {
        Turn turn = settled();
        if (!object_->is_outline_fresh()) {
            nb::gil_scoped_release others_may_run;
            object_->update_outline();
        }
        return turn;
    }

    // Does work that may take long, in this object's turn: others may run, and signals end it.
    template <class Work>
    void at_length(Work work) {
        try {
            nb::gil_scoped_release others_may_run;
            work(poll_signals);
        } catch (const Interrupted&) {
            throw nb::python_error();
        }
    }

   private:
    struct Interrupted {};

    // Python's handlers run with the GIL; if one raised, its exception waits in the thread's state.
    static void poll_signals() {
        nb::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0) throw Interrupted{};
    }

    void settle() {
        if (!object_->is_settled()) bring_up([&](auto poll) { object_->settle(poll); });
    }

    template <class Work>
    void bring_up(Work work) {
        if (!object_->is_long_to_settle()) return work([] {});
        at_length(work);
    }

    std::unique_ptr<Object> object_;
    std::mutex mutex_;
    bool is_taken_ = false;  // the turn; to be read and written with the GIL
    std::atomic<std::int64_t> told_ = 0;
};

// The turns of two objects, which may be one, with their rings. They are taken in the order of
// their addresses, whoever asks: so no circle of threads can wait for each other.
inline std::array<Kernel::Turn, 2> both_turns(Kernel& a, Kernel& b) {
    bool in_order = !std::less<Kernel*>()(&b, &a);
    auto first = (in_order ? a : b).with_ring();
    auto second = &a == &b ? Kernel::Turn() : (in_order ? b : a).with_ring();
    return {std::move(first), std::move(second)};
}

// Asks of both rings.
template <class Ask>
auto with_both_rings(Kernel& a, Kernel& b, Ask ask) {
    auto turns = both_turns(a, b);
    nb::gil_scoped_release others_may_run;
    return ask(a.object().ring(), b.object().ring());
}

// One a stage, each in a file of its own: adds what Python may ask of it.
using KernelClass = nb::class_<Kernel>;
void bind_points(KernelClass& kernel);
void bind_gamma(KernelClass& kernel);
void bind_boundary(KernelClass& kernel);
void bind_flintstone(KernelClass& kernel);
void bind_collision(KernelClass& kernel);
void bind_bounds(KernelClass& kernel);
void bind_scene(nb::module_& module);
void bind_outline(nb::module_& module, KernelClass& kernel);
void bind_quick(nb::module_& module);
void bind_smooth(nb::module_& module, KernelClass& kernel);
void bind_whole(KernelClass& kernel);

}  // namespace flintknap
