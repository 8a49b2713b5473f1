//! A callback as a future.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

/// What the two ends share.
struct State<T> {
    sent: Option<T>,
    /// Whether the end that sends is gone.
    closed: bool,
    waker: Option<Waker>,
}

/// The end that sends, once.
pub(super) struct Sender<T>(Arc<Mutex<State<T>>>);

/// The end that waits: for what is sent, or `None` where nothing ever will be.
pub(super) struct Receiver<T>(Arc<Mutex<State<T>>>);

/// Two ends that belong together.
pub(super) fn signal<T>() -> (Sender<T>, Receiver<T>) {
    let state = Arc::new(Mutex::new(State { sent: None, closed: false, waker: None }));
    (Sender(Arc::clone(&state)), Receiver(state))
}

impl<T> Sender<T> {
    pub fn send(self, value: T) {
        // The drop that follows wakes whoever waits.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).sent = Some(value);
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        let waker = {
            let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            state.closed = true;
            state.waker.take()
        };
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
impl<T> Receiver<T> {
    /// What has been sent so far.
    pub fn now(self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).sent.take()
    }
}

impl<T> Future for Receiver<T> {
    type Output = Option<T>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<T>> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if state.closed {
            return Poll::Ready(state.sent.take());
        }
        state.waker = Some(context.waker().clone());
        Poll::Pending
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_arrives_and_silence_ends_with_the_sender() {
        let (sender, receiver) = signal();
        let thread = std::thread::spawn(move || pollster::block_on(receiver));
        sender.send(7);
        assert_eq!(thread.join().unwrap(), Some(7));
        let (sender, receiver) = signal::<i32>();
        let thread = std::thread::spawn(move || pollster::block_on(receiver));
        drop(sender);
        assert_eq!(thread.join().unwrap(), None);
    }
}
