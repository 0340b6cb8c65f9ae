"""Workers that are this process: for tests of what is done with results, not of where they come from."""

from concurrent.futures import Future

from sgnlp.planning.workers import Workers


class Here(Workers):
    """This process in the place of others."""

    def __init__(self) -> None:
        super().__init__(1)
        self.closed = False

    def submit(self, function, item):
        future: Future = Future()
        try:
            future.set_result(function(item))
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        self.closed = True
