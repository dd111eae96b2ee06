//! Lists of pairs: CSV, JSON Lines, two folders by file stem.
