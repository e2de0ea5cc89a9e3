"""The amplitude above which a chain creeps, by four meanings of the word."""
